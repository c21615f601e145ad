"""Figures 5 and 6: renderings of measured and decoded textures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nacre.errors import NacreError
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.textures.materials import Material
from nacre_lab.reproduce.textures.methods import Method
from nacre_lab.reproduce.textures.rendering import View
from nacre_lab.reproduce.textures.study import Study
from nacre_lab.reproduce.textures.table import error_table
from nacre_lab.reproduce.textures.texture_figures import TRUTH, Cell, cell_page, compared

SIDE = 1.9
"""Inches: edge of a rendering."""


def fig5(study: Study, methods: Sequence[Method]) -> Outcome:
    """Cylinders of unseen textures under an environment, measured and decoded by each method.

    Raises
    ------
    NacreError
        If height fields are given, but not for all textures.
    """
    views = [View(size=study.size, height_field=study.height_field(m)) for m in study.unseen]
    return _rendered(study, methods, study.unseen, views)


def fig6(study: Study, methods: Sequence[Method]) -> Outcome:
    """Cylinders under a point light, of textures unlike those of the training.

    Raises
    ------
    NacreError
        If there are none.
    """
    if not study.others:
        raise NacreError("there are no textures unlike those of the training; add --other FOLDER")
    views = [View(light="point", size=study.size)] * len(study.others)
    return _rendered(study, methods, study.others, views)


def _rendered(
    study: Study, methods: Sequence[Method], materials: Sequence[Material], views: Sequence[View]
) -> Outcome:
    rows: list[Sequence[object]] = []
    lines, whole = [], dict[str, dict[str, float]]()
    seconds: dict[str, list[float]] = {TRUTH: []}
    for material, view in zip(materials, views, strict=True):
        truth = study.rendering(material, None, view)
        assert truth is not None
        seconds[TRUTH].append(truth.seconds)
        line = [Cell(truth.picture)]
        for method in methods:
            found = study.rendering(material, method, view)
            picture = None if found is None else found.picture
            cell = compared(study, method, material, truth.picture, picture)
            line.append(cell)
            if found is not None and cell.mse is not None and cell.whole is not None:
                rows.append((material.name, method.name, cell.mse, cell.whole, found.seconds))
                whole.setdefault(method.name, {})[material.name] = cell.whole
                seconds.setdefault(method.name, []).append(found.seconds)
        lines.append(line)
    names = [material.name for material in materials]
    page = cell_page([TRUTH, *(m.name for m in methods)], names, lines, side=SIDE, exposed=True)
    columns = ("material", "method", "mse of the picture", "mse of all pairs", "seconds")
    means = [[name, f"{np.mean(times):.1f}"] for name, times in seconds.items()]
    times = markdown_table(["rendering", "seconds, mean"], means)
    return Outcome({"": page}, columns, rows, f"{error_table(names, whole)}\n{times}")
