"""Figures 2, 5, 6, 7 and 9: spheres side by side, and where their structure differs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.figures.page import FAINT, Figure, Page, magma
from nacre_lab.reproduce.chart import broken
from nacre_lab.reproduce.study import Study
from nacre_lab.reproduce.summary import readable, summarize
from nacre_lab.reproduce.trial import TRUTH

ROWS = 8
"""Materials on one page of :func:`sphere_pages`."""

_SIDE, _STRIP, _GAP = 1.1, 0.42, 0.08
"""Inches: edge of a sphere, height of what is below it, and between cells."""
_BETWEEN = 0.25
"""Inches between lights."""
_NAMES, _HEAD, _FOOT = 1.35, 0.45, 0.5
"""Inches: width of the materials' names, height of the methods' names and of the color scale."""
_BAR = 2.6
"""Inches: width of the color scale."""
_DARKEST = -4.0
"""Decimal logarithm of 1 - SSIM at the dark end of the color scale."""


def sphere_pages(study: Study, methods: Sequence[str], *lights: str) -> list[Any]:
    """Spheres of every material (rows) with every method (columns), the truth first, by light.

    Below each sphere are a small map of 1 - SSIM and the mean SSIM, the best in a row in bold.

    Parameters
    ----------
    study
        With trials of :data:`nacre_lab.reproduce.trial.TRUTH` and the methods.
    methods
        Columns; those without any trial are left out.
    lights
        Of :data:`nacre_lab.reproduce.trial.LIGHTS`, side by side.

    Returns
    -------
    list of matplotlib.figure.Figure
        One page per :data:`ROWS` materials.
    """
    columns = [TRUTH, *study.tried(methods)]
    materials = [m for m in study.materials if (m, TRUTH) in study.trials]
    pages = [materials[i : i + ROWS] for i in range(0, len(materials), ROWS)]
    return [_page(study, columns, page, lights) for page in pages]


def _page(
    study: Study, columns: Sequence[str], materials: Sequence[str], lights: Sequence[str]
) -> Any:
    cell = _SIDE + _GAP, _SIDE + _STRIP + _GAP
    across = len(columns) * cell[0] + _BETWEEN
    size = (
        _NAMES + len(lights) * across - _BETWEEN,
        _HEAD + len(materials) * cell[1] + _FOOT,
    )
    page = Page(*size)
    for j, material in enumerate(materials):
        y = _HEAD + j * cell[1]
        page.text(0.05, y + 0.5 * _SIDE, broken(material), va="center", size=8.0)
    for k, light in enumerate(lights):
        left = _NAMES + k * across
        for i, method in enumerate(columns):
            x = left + i * cell[0] + 0.5 * _SIDE
            page.text(x, _HEAD - 0.1, broken(method), ha="center", va="bottom", size=8.0)
        for j, material in enumerate(materials):
            _row(page, (left, _HEAD + j * cell[1]), study, columns, material, light)
    _scale(page, _NAMES, size[1] - 0.3)
    return page.figure


def _row(
    page: Page,
    corner: tuple[float, float],
    study: Study,
    columns: Sequence[str],
    material: str,
    light: str,
) -> None:
    """Spheres of one material under one light, from a corner on."""
    figure = f"{light} SSIM"
    trials = {m: study.trials[material, m] for m in columns if (material, m) in study.trials}
    rivals = [trial.figures[figure] for method, trial in trials.items() if method != TRUTH]
    best = max(rivals) if len(rivals) > 1 else None
    for i, method in enumerate(columns):
        x, y = corner[0] + i * (_SIDE + _GAP), corner[1]
        if method not in trials:
            page.text(x + 0.5 * _SIDE, y + 0.5 * _SIDE, "none", ha="center", color=FAINT)
            continue
        picture = study.pictures(material, method)[light]
        page.sphere(x, y, _SIDE, picture.shown / 255.0)
        if method == TRUTH:
            continue
        page.sphere(x + 0.08, y + _SIDE, _STRIP, _error_colors(picture.similarity))
        value = trials[method].figures[figure]
        weight = "bold" if value == best else "normal"
        where = x + _STRIP + 0.14, y + _SIDE + 0.5 * _STRIP
        page.text(*where, readable(value, figure), va="center", fontweight=weight)


def mean_maps(study: Study, methods: Sequence[str], light: str, columns: int = 6) -> Figure:
    """Maps of 1 - SSIM averaged over materials, one per method, with mean ± standard deviation.

    Parameters
    ----------
    study, methods, light
        As for :func:`sphere_pages`; methods are sorted by their mean.
    columns
        Maps in a row.
    """
    figure = f"{light} SSIM"
    found = {m: summarize(study.of(m), figure) for m in study.tried(methods)}
    order = sorted(found, key=lambda method: -found[method].mean)
    columns = min(columns, len(order))
    cell = _SIDE + 3 * _GAP, _SIDE + 0.85
    rows = -(-len(order) // columns)
    page = Page(columns * cell[0] + 2 * _GAP, rows * cell[1] + _FOOT)
    for k, method in enumerate(order):
        x, y = (k % columns) * cell[0] + 2 * _GAP, (k // columns) * cell[1] + 0.4
        pictures = [study.pictures(t.material, method)[light] for t in study.of(method)]
        mean = np.mean([p.similarity.astype(np.float32) for p in pictures], axis=0)
        page.sphere(x, y, _SIDE, _error_colors(mean))
        page.text(x + 0.5 * _SIDE, y - 0.05, broken(method), ha="center", va="bottom", size=8.0)
        item = found[method]
        text = f"{readable(item.mean, figure)} ± {readable(item.deviation, figure)}"
        page.text(x + 0.5 * _SIDE, y + _SIDE + 0.05, text, ha="center", va="top")
        text = f"worst {readable(item.worst, figure)}"
        page.text(x + 0.5 * _SIDE, y + _SIDE + 0.19, text, ha="center", va="top", color=FAINT)
    _scale(page, 4 * _GAP, page.height - 0.3)
    return page.figure


def _scale(page: Page, x: float, y: float) -> None:
    """The color scale of 1 - SSIM."""
    page.image(x, y, _BAR, 0.1, magma(np.linspace(0.0, 1.0, 256))[None])
    exponents = range(round(_DARKEST), 1)
    for exponent in exponents:
        place = x + _BAR * (exponent - _DARKEST) / -_DARKEST
        page.text(place, y + 0.13, f"{10.0**exponent:g}", ha="center", va="top", color=FAINT)
    page.text(x + _BAR + 0.25, y + 0.05, "1 − SSIM", va="center", color=FAINT)


def _error_colors(similarity: Floats) -> Floats:
    """Colors of 1 - SSIM on the logarithmic scale."""
    error = 1.0 - similarity.astype(np.float32)
    return magma(1.0 - np.log10(np.clip(error, 10.0**_DARKEST, 1.0)) / _DARKEST)
