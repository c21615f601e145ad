"""Figure 7: errors against the fraction of the directions from which texels are encoded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre_lab.reproduce.chart import charts, color_of, dress, line_style
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import geometric_mean, markdown_table, scaled
from nacre_lab.reproduce.textures.methods import Method
from nacre_lab.reproduce.textures.sampling import APART, AT_HELD_OUT, FRACTIONS, LOW_VIEWS, Sampling
from nacre_lab.reproduce.textures.study import Study

TEXELS = 64
"""Random texels of each material."""
_Point: TypeAlias = tuple[npt.NDArray[np.float64], float]
"""Losses of texels, and the geometric mean over materials of mean squared errors."""
_SAMPLINGS = (*FRACTIONS, LOW_VIEWS, AT_HELD_OUT, APART)


def fig7(study: Study, methods: Sequence[Method]) -> Outcome:
    """Losses of texels of unseen materials encoded from some of their pairs."""
    rows: list[Sequence[object]] = []
    lines: list[list[str]] = []
    curves: dict[str, list[_Point]] = {}
    for method in methods:
        points: dict[str, _Point] = {}
        for sampling in _SAMPLINGS:
            found = _losses(study, method, sampling)
            if found is None:
                continue
            rows += [(name, method.name, sampling.name, *facts) for name, *facts in found[0]]
            points[sampling.name] = found[1]
        for sampling in (sampling for sampling in _SAMPLINGS if sampling.name in points):
            losses, mse = points[sampling.name]
            other = points.get((AT_HELD_OUT if sampling == APART else FRACTIONS[-1]).name)
            ratio = "" if other is None or sampling == AT_HELD_OUT else f"{mse / other[1]:.3f}"
            loss = f"{losses.mean():.4f} ± {losses.std():.4f}"
            lines.append([f"{method.name}, {sampling.name}", loss, scaled(mse), ratio])
        if all(sampling.name in points for sampling in FRACTIONS):
            curves[method.name] = [points[sampling.name] for sampling in FRACTIONS]
    columns = ("material", "method", "pairs seen", "loss", "deviation of the loss", "mse")
    head = ["method, pairs seen", "loss", "MSE x 10⁴", "over that from all pairs"]
    return Outcome({"": _plot(curves)}, columns, rows, markdown_table(head, lines))


def _losses(
    study: Study, method: Method, sampling: Sampling
) -> tuple[list[tuple[str, float, float, float]], _Point] | None:
    """For each material and all: mean and deviation of the loss, and mean squared error."""
    deviation = study.deviation()
    rows, losses, squares = [], [], []
    for material in study.unseen:
        found = study.errors(method, material, sampling, TEXELS)
        if found is None:
            return None
        loss = found.logarithms / deviation
        losses.append(loss)
        squares.append(found.mse)
        rows.append((material.name, float(loss.mean()), float(loss.std()), found.mse))
    pooled, mse = np.concatenate(losses), geometric_mean(squares)
    rows.append(("all", float(pooled.mean()), float(pooled.std()), mse))
    return rows, (pooled, mse)


def _plot(curves: Mapping[str, Sequence[_Point]]) -> Any:
    """Loss with its deviation, and mean squared error, against the fraction of pairs."""
    figure, (left, right) = charts(2, 9.0, 3.8)
    x = [100.0 * sampling.fraction for sampling in FRACTIONS]
    for index, (name, points) in enumerate(curves.items()):
        mean = np.array([loss.mean() for loss, _ in points])
        deviation = np.array([loss.std() for loss, _ in points])
        left.fill_between(
            x, mean - deviation, mean + deviation, color=color_of(index), alpha=0.15, lw=0
        )
        left.plot(x, mean, label=name, **line_style(index))
        right.plot(x, [1e4 * mse for _, mse in points], label=name, **line_style(index))
    for axes, title, log in (
        (left, "loss of whitened logarithms, mean ± deviation", "x"),
        (right, "mean squared error x 10⁴, geometric mean", "xy"),
    ):
        dress(axes, title, "pairs of directions seen, %", log=log)
        axes.set_xticks(x, [f"{tick:g}" for tick in x])
    left.set_ylim(bottom=0.0)
    right.legend(fontsize=8, frameon=False)
    return figure
