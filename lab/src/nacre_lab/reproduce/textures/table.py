"""Table 1: errors of unseen materials by method and size of codes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nacre.figures.page import Figure
from nacre.figures.plot import COLORS
from nacre_lab.reproduce.chart import charts, color_of, dress
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import geometric_mean, markdown_table, scaled
from nacre_lab.reproduce.textures.methods import Method
from nacre_lab.reproduce.textures.study import Study

_MARKERS = "osD^vP*X"


def table1(study: Study, methods: Sequence[Method]) -> Outcome:
    """Mean squared error of each unseen material with each method.

    Raises
    ------
    NacreError
        If a codec cannot be made, or a second measurement has other directions.
    """
    columns = ("material", "method", "values", "mse", "loss")
    rows: list[Sequence[object]] = []
    series: dict[str, dict[str, float]] = {}
    deviation = study.deviation()
    for method in methods:
        for material in study.unseen:
            found = study.errors(method, material)
            if found is None:
                continue
            series.setdefault(method.name, {})[material.name] = found.mse
            loss = float(found.logarithms.mean()) / deviation
            rows.append((material.name, method.name, method.code_dim, found.mse, loss))
    unseen = {material.name: material for material in study.unseen}
    again = {material.name: material for material in study.again}
    for name in (name for name in unseen if name in again):
        floor = study.noise(unseen[name], again[name])
        series.setdefault("noise", {})[name] = floor
        rows.append((name, "noise", "", floor, ""))
    names = list(unseen)
    table = error_table(names, series)
    return Outcome({"": error_plot(names, series)} if series else {}, columns, rows, table)


def error_table(names: Sequence[str], series: Mapping[str, Mapping[str, float]]) -> str:
    """Mean squared errors times ten thousand, one line per method, and their geometric mean.

    `series` has errors by method and material; the mean is left out if some are missing.
    """
    lines = []
    for method, errors in series.items():
        mean = geometric_mean(list(errors.values())) if len(errors) == len(names) else None
        lines.append([method, *(scaled(errors.get(name)) for name in names), scaled(mean)])
    return markdown_table(["MSE x 10⁴", *names, "geometric mean"], lines)


def error_plot(names: Sequence[str], series: Mapping[str, Mapping[str, float]]) -> Figure:
    """The same as markers over the materials."""
    figure, (axes,) = charts(1, 1.6 + 1.1 * (len(names) + 1), 4.5)
    for index, (method, errors) in enumerate(series.items()):
        places = [k for k, name in enumerate(names) if name in errors]
        values = [1e4 * errors[names[k]] for k in places]
        if len(places) == len(names):
            places.append(len(names))
            values.append(geometric_mean(values))
        shift = 0.7 * ((index + 0.5) / len(series) - 0.5)
        axes.scatter(
            np.array(places) + shift,
            values,
            s=26,
            marker=_MARKERS[index // len(COLORS) % len(_MARKERS)],
            color=color_of(index),
            label=method,
        )
    for edge in range(len(names)):
        axes.axvline(edge + 0.5, color="#e6e6e3", linewidth=0.8, zorder=0)
    dress(axes, y="mean squared error x 10⁴", log="y", grid="y")
    axes.set_xticks(range(len(names) + 1), [*names, "geometric\nmean"])
    axes.set_xlim(-0.5, len(names) + 0.5)
    axes.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
