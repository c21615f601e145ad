"""Plots of multi-angle colors: what the chips and lines hold."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.analytic import MODELS
from nacre.figures.angles import multiangle_figure
from nacre.instruments import E2539, multiangle

pytest.importorskip("matplotlib", reason="needs the extra 'plot'")


def test_chips_and_lines_are_the_readings():
    gray = multiangle(MODELS["lambert"](diffuse=(0.2, 0.2, 0.2)), E2539)
    bright = multiangle(MODELS["lambert"](diffuse=(5.0, 0.5, 0.5)), E2539)
    figure = multiangle_figure({"gray": gray, "bright": bright})
    chart, *chips = figure.axes
    assert len(chips) == 2 * len(E2539)
    colors = [chip.images[0].get_array()[0, 0] for chip in chips]
    np.testing.assert_array_equal(colors[0], [np.rint(255.0 * 0.2 ** (1.0 / 2.2))] * 3)
    assert colors[-1][0] == 255
    assert colors[-1][1] == colors[-1][2] < 255
    points = [line.get_ydata() for line in chart.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(points[0], 51.837, atol=1e-3)
    assert chart.get_ylim()[1] > points[1][0] > 100.0
    runs = [line.get_xdata() for line in chart.lines if line.get_marker() != "o"]
    assert [list(run) for run in runs if len(run) > 2][:2] == [[*range(6)], [*range(6, 11)]]
