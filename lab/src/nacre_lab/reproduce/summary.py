"""Trials as tables: CSV with all of them, Markdown with mean, spread and worst."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from nacre_lab.reproduce.study import Study
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.trial import HIGHER_IS_BETTER, Trial

_DECIMALS = {"SSIM": 4, "PSNR": 1}
"""Decimals of figures in tables; other errors have four."""
_HIGHER_IS_BETTER = (*HIGHER_IS_BETTER, "rays per second")


@dataclass(frozen=True)
class Summary:
    """One figure of a method over materials, with the population's standard deviation and the worst
    material.
    """

    mean: float
    deviation: float
    worst: float
    material: str


def summarize(trials: Sequence[Trial], figure: str) -> Summary:
    """Mean, standard deviation and worst of a figure; `trials` has at least one."""
    values = np.array([trial.figures[figure] for trial in trials])
    order = np.argsort(values)
    worst = int(order[0] if figure.endswith(_HIGHER_IS_BETTER) else order[-1])
    with np.errstate(invalid="ignore"):  # equal pictures have an infinite PSNR
        mean, deviation = float(values.mean()), float(values.std())
    return Summary(mean, deviation, float(values[worst]), trials[worst].material)


def markdown(study: Study, methods: Iterable[str], figures: Sequence[str], title: str = "") -> str:
    """A table with one line per method, by size: mean ± standard deviation, worst (material).

    Words that the figures' names share with the title are left out of the column heads.
    """
    heads = (figure.removeprefix(f"{title} ") for figure in figures)
    columns = ("method", "bytes", "materials", *heads)
    lines = []
    for method in sorted(study.tried(methods), key=study.mean_size):
        trials = study.of(method)
        cells = (cell(summarize(trials, figure), figure) for figure in figures)
        lines.append((method, f"{study.mean_size(method):,.0f}", str(len(trials)), *cells))
    return markdown_table(columns, lines)


def readable(value: float, figure: str) -> str:
    """A figure as text, with the decimals for tables."""
    if not math.isfinite(value):
        return "∞" if value > 0 else "–"
    return f"{value:.{_DECIMALS.get(figure.rpartition(' ')[2], 4)}f}"


def all_trials(study: Study, methods: Iterable[str]) -> tuple[list[str], list[Sequence[object]]]:
    """Columns and rows with every trial of the methods: sizes, seconds, and all figures."""
    trials = [trial for method in methods for trial in study.of(method)]
    figures = list(trials[0].figures) if trials else []
    rows: list[Sequence[object]] = [
        (t.material, t.method, t.size, round(t.seconds, 3), *(t.figures[f] for f in figures))
        for t in trials
    ]
    return ["material", "method", "bytes", "seconds", *figures], rows


def cell(summary: Summary, figure: str) -> str:
    """A figure in a table: mean ± standard deviation, worst (material)."""
    values = summary.mean, summary.deviation, summary.worst
    mean, deviation, worst = (readable(value, figure) for value in values)
    return f"{mean} ± {deviation}, {worst} ({summary.material})"
