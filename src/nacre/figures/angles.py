"""Colors at several angles: a chip for each, and lightness over them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.color import REC_709, lab_to_xyz, rgb_to_xyz_matrix, tone_map, xyz_to_rgb
from nacre.figures.page import FAINT, INK, RULE, Page
from nacre.figures.plot import COLORS
from nacre.instruments import Color, Multiangle

_WIDTH, _MARGIN = 8.0, 0.25  # inches
_CHIP, _GAP, _CHART = 0.5, 0.3, 2.0
_FEW = 8  # geometries whose names need not be turned
_LABELS = 0.35, 1.15  # inches for the names of few and of many


def multiangle_figure(readings: Mapping[str, Multiangle]) -> Any:
    """Draw the readings of one or two materials by name, at the same geometries.

    Chips show CIELAB on a display of D65, clipped at its white; lines below show L*, which is above
    100 in a highlight.

    Returns
    -------
    matplotlib.figure.Figure
        For :func:`nacre.figures.plot.write_plot`.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    first = next(iter(readings.values()))
    names = [geometry.name for geometry in first.geometries]
    top = 0.15 + len(readings) * (_CHIP + _GAP)
    page = Page(_WIDTH, top + _CHART + _LABELS[len(names) > _FEW])
    across = _WIDTH - 2.0 * _MARGIN - 0.3
    step = across / len(names)
    x = _MARGIN + 0.3
    axes = page.axes(x, top, across, _CHART)
    axes.set_xlim(-0.5, len(names) - 0.5)
    highest = max(color.lab[0] for found in readings.values() for color in found.colors)
    axes.set_ylim(0.0, max(100.0, 1.05 * highest))
    for lightness in np.arange(0.0, max(100.0, highest) + 1.0, 50.0):
        axes.axhline(lightness, color=RULE, linewidth=0.6, zorder=0)
        axes.text(
            -0.55, lightness, f"{lightness:g}", color=FAINT, fontsize=8, ha="right", va="center"
        )
    for row, (name, found) in enumerate(readings.items()):
        y = 0.32 + row * (_CHIP + _GAP)
        page.text(x, y - 0.07, name, 9.0, COLORS[row] if len(readings) > 1 else INK, limit=across)
        chips = np.array([_displayed(color) for color in found.colors])
        for index, chip in enumerate(chips):
            page.image(x + index * step + 0.02, y, step - 0.04, _CHIP, chip[None, None], False)
        lightness = [color.lab[0] for color in found.colors]
        axes.plot(lightness, color=COLORS[row], marker="o", markersize=4, linestyle="")
        for run in _runs(first):
            axes.plot(run, lightness[run.start : run.stop], color=COLORS[row], linewidth=1.2)
    turn = {"rotation": 90} if len(names) > _FEW else {}
    for index, name in enumerate(names):
        place = x + (index + 0.5) * step, top + _CHART + 0.08
        page.text(*place, name, 8.0, INK, ha="center", va="top", **turn)
    page.text(_MARGIN - 0.1, top + 0.5 * _CHART, "L*", 9.0, INK, va="center")
    return page.figure


def _runs(found: Multiangle) -> list[range]:
    """Where geometries follow one another in the plane of incidence, under one light."""
    lights = [g.light if g.azimuth is None else None for g in found.geometries]
    starts = [
        i for i, light in enumerate(lights) if i == 0 or light is None or light != lights[i - 1]
    ]
    return [range(a, b) for a, b in itertools.pairwise([*starts, len(lights)])]


def _displayed(color: Color) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Display values, (3,), of a color that looks the same beside the white of the display."""
    white = rgb_to_xyz_matrix(REC_709).sum(axis=1)
    return np.asarray(tone_map(xyz_to_rgb(lab_to_xyz(color.lab) * white)), np.float64)
