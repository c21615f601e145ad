"""Figures 13 to 16: noisy pictures side by side, and their errors against samples and time."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nacre.color import tone_map
from nacre.errors import require
from nacre.figures.plot import COLORS
from nacre.figures.polar import FAINT, INK
from nacre.io.files import atomic_path
from nacre.reproduce.noise import MEASURES
from nacre.reproduce.noise_study import NoiseStudy

_EDGE, _GAP, _HEAD, _CAPTION = 2.3, 0.06, 0.42, 0.2
"""Inches: width of a picture, space between, and heights of titles and captions."""
_PANEL = 3.0
"""Inches: width and height of a plot."""


def picture_page(study: NoiseStudy, samplers: Sequence[str]) -> Any:
    """The reference and a picture by every sampler, a row for each thing that is shown.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    columns, rows = 1 + len(samplers), len(study.references)
    width, height = study.settings.size
    tall = _EDGE * height / width
    size = columns * (_EDGE + _GAP) + _GAP, rows * (tall + _CAPTION) + _HEAD
    figure = require("matplotlib.figure", "plot").Figure(size, facecolor="white")
    at = study.settings.counts.index(study.settings.shown)
    for i, (name, truth) in enumerate(study.references.items()):
        bottom = size[1] - _HEAD - i * (tall + _CAPTION) - tall
        for j, sampler in enumerate((None, *samplers)):
            left = _GAP + j * (_EDGE + _GAP)
            box = left / size[0], bottom / size[1], _EDGE / size[0], tall / size[1]
            axes = figure.add_axes(box)
            axes.set_axis_off()
            if sampler is None:
                picture, title = truth, f"reference, {study.settings.reference} samples"
                caption = name
            else:
                found = study.found[name, sampler]
                picture, title = found.picture, f"{sampler}, {study.settings.shown} samples"
                caption = f"RMSE {found.errors['RMSE'][at]:.4f}, {found.seconds[at]:.1f} s"
            axes.imshow(tone_map(picture), interpolation="nearest")
            if i == 0:
                axes.set_title(title, fontsize=8, color=INK, pad=4)
            style = {"fontsize": 7, "color": FAINT, "ha": "left", "va": "top"}
            axes.text(0.0, -0.02, caption, transform=axes.transAxes, **style)
    return figure


def error_page(study: NoiseStudy, samplers: Sequence[str]) -> Any:
    """Mean errors of all pictures against samples per pixel, and RMSE against seconds.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    count = len(MEASURES) + 1
    figure = require("matplotlib.figure", "plot").Figure(
        (_PANEL * count, _PANEL * 1.1), facecolor="white", layout="constrained"
    )
    for k, axes in enumerate(figure.subplots(1, count)):
        measure = MEASURES[k] if k < len(MEASURES) else "RMSE"
        for index, sampler in enumerate(samplers):
            x = study.settings.counts if k < len(MEASURES) else study.seconds(sampler)
            values = study.mean(sampler, measure)
            style = {"color": COLORS[index % len(COLORS)], "marker": "o", "markersize": 3}
            axes.plot(x, values, label=sampler, linewidth=1.2, **style)
        axes.set_xscale("log", base=2)
        if measure != "PSNR":
            axes.set_yscale("log")
        axes.set_title("PSNR, dB" if measure == "PSNR" else measure, fontsize=9, color=INK)
        label = "samples per pixel" if k < len(MEASURES) else "seconds a picture"
        axes.set_xlabel(label, fontsize=8, color=FAINT)
        axes.tick_params(which="both", labelsize=7, colors=FAINT)
        axes.grid(True, color="#e6e6e3", linewidth=0.6)
    axes.legend(fontsize=7, frameon=False)
    return figure


def equal_time(study: NoiseStudy, sampler: str, seconds: float) -> float:
    """Mean RMSE of a sampler after a time, between the counts of samples in log-log."""
    x, y = np.log(study.seconds(sampler)), np.log(study.mean(sampler, "RMSE"))
    return float(np.exp(np.interp(np.log(seconds), x, y)))


def noise_table(study: NoiseStudy, samplers: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Head and rows: errors at the count that is shown, its seconds, and RMSE at equal time.

    The time is that of the fastest sampler at that count.
    """
    at = study.settings.counts.index(study.settings.shown)
    budget = min(float(study.seconds(sampler)[at]) for sampler in samplers)
    rows = []
    for sampler in samplers:
        means = [float(study.mean(sampler, measure)[at]) for measure in MEASURES]
        cells = [f"{value:.4f}" for value in means[:-1]] + [f"{means[-1]:.1f}"]
        seconds = float(study.seconds(sampler)[at])
        same = equal_time(study, sampler, budget)
        rows.append([sampler, *cells, f"{seconds:.2f}", f"{same:.4f}"])
    return ["sampler", *MEASURES, "seconds", f"RMSE after {budget:.2f} s"], rows


def write_noise(study: NoiseStudy, samplers: Sequence[str], path: Path) -> None:
    """Write every error of every picture as CSV.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["picture", "sampler", "samples", "seconds", *MEASURES])
        for name in study.references:
            for sampler in samplers:
                found = study.found[name, sampler]
                for k, count in enumerate(study.settings.counts):
                    values = (found.seconds[k], *(found.errors[m][k] for m in MEASURES))
                    writer.writerow([name, sampler, count, *(f"{v:.6g}" for v in values)])
