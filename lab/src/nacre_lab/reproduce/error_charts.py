"""Figures 10 and 17: errors of methods by material, and against memory."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from typing import Any

import numpy as np

from nacre.figures.page import FAINT, INK, Figure, Page
from nacre.figures.plot import COLORS
from nacre_lab.reproduce.chart import dress, place_labels
from nacre_lab.reproduce.methods import ENHANCED_SIZES, SIZES
from nacre_lab.reproduce.study import Study
from nacre_lab.reproduce.summary import Summary, summarize
from nacre_lab.reproduce.trial import HIGHER_IS_BETTER, LIGHTS

FAMILIES = {"network": COLORS[0], "analytic": COLORS[1], "table": COLORS[2]}
"""Colors of the families of methods; others are black."""

FLOOR = 1e-5
"""Least 1 - SSIM in the plot; smaller values are drawn there."""

_ROW, _PANEL, _NAMES, _SPACE = 0.24, 3.4, 1.6, 1.1
"""Inches: height of a row, width of a panel, of the methods' names, and of the right margin."""
_SERIES = tuple(SIZES), tuple(ENHANCED_SIZES)
"""Networks that differ only in their size."""
_HIGHEST_PSNR = 60.0
"""Value drawn for an infinite PSNR, in dB."""


def error_strips(study: Study, methods: Sequence[str]) -> Figure:
    """1 - SSIM of every material, a dot each, in a row for each method; a panel for each light.

    A bar is the mean; the worst material is named. Rows are sorted by the mean under the first
    light.

    Parameters
    ----------
    study
        With trials of the methods; those without any are left out.
    methods
        Names.
    """
    first = f"{LIGHTS[0]} SSIM"
    found = sorted(study.tried(methods), key=lambda method: summarize(study.of(method), first).mean)
    tall = len(found) * _ROW
    page = Page(_NAMES + len(LIGHTS) * (_PANEL + _SPACE), tall + 0.9, "white")
    for k, light in enumerate(LIGHTS):
        axes = page.axes(_NAMES + k * (_PANEL + _SPACE), 0.35, _PANEL, tall)
        axes.set_axis_on()
        _strip(axes, study, found, light)
        axes.set_yticks(range(len(found)), found if k == 0 else [])
    page.text(0.1, 0.18, "dot: a material; bar: mean; named: worst", 8.0, FAINT)
    return page.figure


def _strip(axes: Any, study: Study, methods: Sequence[str], light: str) -> None:
    name = f"{light} SSIM"
    for row, method in enumerate(methods):
        trials = study.of(method)
        color = FAMILIES.get(study.methods[method].family, INK)
        errors = [_error(trial.figures[name]) for trial in trials]
        dots = {"color": color, "markersize": 3.5, "alpha": 0.5, "markeredgewidth": 0.0}
        axes.plot(errors, [row] * len(errors), "o", **dots)
        item = summarize(trials, name)
        axes.plot([_error(item.mean)] * 2, [row - 0.35, row + 0.35], color=INK, linewidth=1.2)
        text = {"va": "center", "fontsize": 7, "color": FAINT, "parse_math": False}
        place = {"xytext": (4, 0), "textcoords": "offset points"}
        axes.annotate(item.material, (_error(item.worst), row), **place, **text)
    dress(axes, x=f"1 − SSIM, {light}", log="x", grid="x")
    axes.set_ylim(-0.7, len(methods) - 0.3)


def size_plot(study: Study, methods: Sequence[str], light: str) -> Figure:
    """Mean SSIM and PSNR of every method against its bytes.

    Networks of several sizes are joined by a line. Thin bars are standard deviations over
    materials; small dashes are the worst material.

    Parameters
    ----------
    study
        With trials of the methods; those without any are left out.
    methods
        Names.
    light
        One of :data:`nacre_lab.reproduce.trial.LIGHTS`.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    page = Page(10.5, 5.2, "white")
    found = study.tried(methods)
    for k, measure in enumerate(HIGHER_IS_BETTER):
        axes = page.axes(0.7 + 5.2 * k, 0.2, 4.3, 4.3)
        axes.set_axis_on()
        _panel(axes, study, found, f"{light} {measure}")
    return page.figure


def _panel(axes: Any, study: Study, methods: Sequence[str], name: str) -> None:
    structural = name.endswith("SSIM")
    places, drawn = {}, []
    for method in methods:
        x = study.mean_size(method)
        y, low, high, worst = _heights(summarize(study.of(method), name), structural)
        drawn += [y, worst]
        color = FAMILIES.get(study.methods[method].family, INK)
        axes.plot([x, x], [low, high], color=color, linewidth=0.7, alpha=0.35)
        axes.plot(x, worst, "_", color=color, markersize=5, alpha=0.6)
        axes.plot(x, y, "o", color=color, markersize=4, zorder=3)
        places[method] = x, y
    for series in _SERIES:
        line = sorted(places[method] for method in methods if method in series)
        axes.plot(*np.reshape(line, (-1, 2)).T, color=FAMILIES["network"], linewidth=1.2)
    label = name + (" (axis: logarithm of 1 − SSIM)" if structural else " in dB")
    dress(axes, "", "bytes", f"{label}, mean of materials", log="xy" if structural else "x")
    axes.set_ylim(min(drawn) / 3.0 if structural else min(drawn) - 1.0, None)
    ends = [x for x, _ in places.values()]
    axes.set_xlim(min(ends) / 1.6, max(ends) * 2.2)
    if structural:
        axes.invert_yaxis()
        axes.yaxis.set_major_formatter(lambda error, _: f"{1.0 - error:.5g}")
        axes.yaxis.set_minor_formatter(lambda error, _: "")
    axes.text(0.99, 0.01, "bar: ± standard deviation; dash: worst material", fontsize=7,
              color=FAINT, ha="right", va="bottom", transform=axes.transAxes)  # fmt: skip
    points = np.array(list(places.values()))
    place_labels(axes, points, [_label(method, places) for method in places], size=7.5)


def _label(method: str, drawn: Container[str]) -> str:
    """A method's label; within a line of several sizes, only the number of weights."""
    for series in _SERIES:
        sizes = [name for name in series if name in drawn]
        if method in sizes[:-1]:
            return method.rpartition("-")[2]
    return method


def _heights(item: Summary, structural: bool) -> list[float]:
    """Mean, mean minus and plus a standard deviation, and worst, as drawn."""
    spread = item.deviation if math.isfinite(item.deviation) else 0.0
    values = item.mean, item.mean - spread, item.mean + spread, item.worst
    return [_error(v) if structural else min(v, _HIGHEST_PSNR) for v in values]


def _error(similarity: float) -> float:
    """1 - SSIM as drawn."""
    return max(1.0 - similarity, FLOOR)
