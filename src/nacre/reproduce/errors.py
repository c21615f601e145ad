"""Figure 10: the error of every material by every method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.errors import require
from nacre.figures.plot import COLORS
from nacre.figures.polar import FAINT, INK
from nacre.reproduce.study import Study
from nacre.reproduce.summary import summarize
from nacre.reproduce.trial import LIGHTS

FAMILIES = {"network": COLORS[0], "analytic": COLORS[1], "table": COLORS[2]}
"""Colors of the families of methods; any other is ink."""

FLOOR = 1e-5
"""Least 1 - SSIM that is drawn; what is below lies there."""

_ROW, _PANEL, _NAMES, _SPACE = 0.24, 3.4, 1.5, 1.0
"""Inches: height of a row, width of a panel, of the methods' names, and right of a panel."""


def error_strips(study: Study, methods: Sequence[str]) -> Any:
    """1 - SSIM of every material, a dot each, in a row for each method; a panel for each light.

    A bar is the mean; the worst material is named. Rows come by their mean under the first light.

    Parameters
    ----------
    study
        With trials of the methods; those without any are left out.
    methods
        Names.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    found = [method for method in methods if study.of(method)]
    found.sort(key=lambda method: summarize(study.of(method), f"{LIGHTS[0]} SSIM").mean)
    width = _NAMES + len(LIGHTS) * (_PANEL + _SPACE)
    height = len(found) * _ROW + 0.9
    figure = require("matplotlib.figure", "plot").Figure((width, height), facecolor="white")
    for k, light in enumerate(LIGHTS):
        left = _NAMES + k * (_PANEL + _SPACE)
        box = left / width, 0.55 / height, _PANEL / width, len(found) * _ROW / height
        axes = figure.add_axes(box)
        _panel(axes, study, found, light)
        axes.set_yticks(range(len(found)), found if k == 0 else [])
    note = {"fontsize": 7, "color": FAINT, "va": "top"}
    figure.text(
        0.1 / width, 1.0 - 0.06 / height, "dot: a material; bar: mean; named: worst", **note
    )
    return figure


def _panel(axes: Any, study: Study, methods: Sequence[str], light: str) -> None:
    name = f"{light} SSIM"
    for row, method in enumerate(methods):
        trials = study.of(method)
        color = FAMILIES.get(study.methods[method].family, INK)
        errors = np.maximum(1.0 - np.array([t.figures[name] for t in trials]), FLOOR)
        axes.plot(errors, np.full(len(errors), row), "o", markersize=3.5, color=color, alpha=0.5,
                  markeredgewidth=0.0)  # fmt: skip
        item = summarize(trials, name)
        axes.plot([max(1.0 - item.mean, FLOOR)] * 2, [row - 0.35, row + 0.35], color=INK,
                  linewidth=1.2)  # fmt: skip
        text = {"va": "center", "fontsize": 6, "color": FAINT, "parse_math": False}
        axes.annotate(item.material, (max(1.0 - item.worst, FLOOR), row), (4, 0),
                      textcoords="offset points", **text)  # fmt: skip
    prepare(axes, "x", f"1 − SSIM, {light}")
    axes.set_ylim(-0.7, len(methods) - 0.3)


def prepare(axes: Any, axis: str, label: str) -> None:
    """A logarithmic axis for errors, with a faint grid and no frame."""
    axes.set(**{f"{axis}scale": "log"})
    axes.grid(axis="both" if axis == "y" else "x", color="#e4e4e1", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.tick_params(which="both", length=0, labelsize=7, labelcolor=INK)
    for spine in axes.spines.values():
        spine.set_visible(False)
    getattr(axes, f"set_{axis}label")(label, fontsize=8, color=INK)
