"""Figure 17: fidelity against the memory that a representation takes."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from typing import Any

from nacre.errors import require
from nacre.figures.labels import place_labels
from nacre.figures.polar import FAINT, INK
from nacre.reproduce.errors import FAMILIES, FLOOR, prepare
from nacre.reproduce.methods import ENHANCED_SIZES, SIZES
from nacre.reproduce.study import Study
from nacre.reproduce.summary import Summary, summarize
from nacre.reproduce.trial import HIGHER_IS_BETTER

_SIZE = 10.5, 5.2
_SERIES = tuple(SIZES), tuple(ENHANCED_SIZES)
"""Networks that differ only in their size."""
_LOWEST_PSNR = 60.0
"""What an infinite PSNR is drawn as, in dB."""


def footprint_plot(study: Study, methods: Sequence[str], light: str) -> Any:
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
        One of :data:`nacre.reproduce.trial.LIGHTS`.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    figure = require("matplotlib.figure", "plot").Figure(_SIZE, facecolor="white")
    found = [method for method in methods if study.of(method)]
    for k, measure in enumerate(HIGHER_IS_BETTER):
        axes = figure.add_axes((0.065 + 0.49 * k, 0.12, 0.415, 0.84))
        _panel(axes, study, found, f"{light} {measure}")
    return figure


def _panel(axes: Any, study: Study, methods: Sequence[str], name: str) -> None:
    structural = name.endswith("SSIM")
    places = {}
    for method in methods:
        trials = study.of(method)
        x = study.mean_size(method)
        item = summarize(trials, name)
        y, low, high, worst = _heights(item, structural)
        color = FAMILIES.get(study.methods[method].family, INK)
        axes.plot([x, x], [low, high], color=color, linewidth=0.7, alpha=0.35)
        axes.plot(x, worst, "_", color=color, markersize=5, alpha=0.6)
        axes.plot(x, y, "o", color=color, markersize=4, zorder=3)
        places[method] = x, y
    for series in _SERIES:
        line = sorted(places[method] for method in methods if method in series)
        across, up = ([point[k] for point in line] for k in (0, 1))
        axes.plot(across, up, color=FAMILIES["network"], linewidth=1.2)
    axes.set_xscale("log")
    inner = [summarize(study.of(method), name) for method in methods]
    shown = [v for item in inner for v in _heights(item, structural)[::3]]  # means and worst
    axes.set_ylim(min(shown) / 3.0 if structural else min(shown) - 1.0, None)
    prepare(axes, "y" if structural else "x", "")
    axes.grid(axis="both", color="#e4e4e1", linewidth=0.5)
    axes.set_xlabel("bytes", fontsize=8, color=INK)
    ends = [x for x, _ in places.values()]
    axes.set_xlim(min(ends) / 1.6, max(ends) * 2.2)
    label = name + (" (axis: logarithm of 1 − SSIM)" if structural else " in dB")
    axes.set_ylabel(label + ", mean of materials", fontsize=8, color=INK)
    if structural:
        axes.invert_yaxis()
        axes.yaxis.set_major_formatter(lambda error, _: f"{1.0 - error:.5g}")
        axes.yaxis.set_minor_formatter(lambda error, _: "")
    axes.xaxis.set_major_formatter(lambda size, _: f"{size:,.0f}")
    axes.text(0.99, 0.01, "bar: ± standard deviation; dash: worst material", fontsize=6.5,
              color=FAINT, ha="right", va="bottom", transform=axes.transAxes)  # fmt: skip
    place_labels(axes, [(*place, _label(method, places)) for method, place in places.items()])


def _label(method: str, shown: Container[str]) -> str:
    """A method's name; only the number of weights inside a line of several sizes."""
    for series in _SERIES:
        sizes = [name for name in series if name in shown]
        if method in sizes[:-1]:
            return method.rpartition("-")[2]
    return method


def _heights(item: Summary, structural: bool) -> tuple[float, float, float, float]:
    """Mean, mean less and more a standard deviation, and worst, as they are drawn."""
    spread = item.deviation if math.isfinite(item.deviation) else 0.0
    values = item.mean, item.mean - spread, item.mean + spread, item.worst
    if structural:
        mean, low, high, worst = (max(1.0 - v, FLOOR) for v in values)
    else:
        mean, low, high, worst = (min(v, _LOWEST_PSNR) for v in values)
    return mean, low, high, worst
