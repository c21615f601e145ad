"""Figures 11 and 12: a map of codes, and what lies between them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nacre.errors import NacreError
from nacre.figures.code_views import between, coded, displayed, draw_map
from nacre.figures.page import Page, broken
from nacre.latent.basis import LatentBasis
from nacre.runtime.progress import Progress

COUNT = 5
"""Materials in a row of Figure 12, both ends too."""

MAP_DIFFERS = (
    "codes of the basis given, found by `nacre latent encode`; the materials given; those that the "
    "basis was not trained on, by their names, are ringed"
)
ROWS_DIFFER = (
    "codes of the basis given, found by `nacre latent encode`; the materials given; the ball of "
    "`nacre render` in place of the paper's scene"
)

_SIDE, _GAP, _NAMES = 1.2, 0.08, 1.25
"""Inches: edge of a picture, between two, and width of the names on either side."""


def map_page(
    files: Sequence[Path], basis: LatentBasis, seed: int, progress: Progress
) -> tuple[Any, int]:
    """Figure 11: the t-SNE map of codes, those that the basis was not trained on ringed in red.

    Parameters
    ----------
    files
        Materials or codes.
    basis
        Names its materials in its metadata.
    seed
        The same seed gives the same map.
    progress
        Called as it goes on.

    Returns
    -------
    figure : matplotlib.figure.Figure
        One page.
    ringed : int
        How many.

    Raises
    ------
    NacreError
        If a file cannot be read, there are too few, or the basis names no materials.
    MissingExtraError
        If openTSNE or Matplotlib is not installed.
    """
    known = basis.metadata.get("materials")
    if not isinstance(known, list):
        raise NacreError("the basis does not say which materials it was trained on")
    materials = coded(files, basis, progress)
    names = [path.stem for path in files]
    new = [n for n, material in zip(names, materials, strict=True) if material.name not in known]
    return draw_map(names, materials, new, seed, progress), len(new)


def row_page(
    files: Sequence[Path], basis: LatentBasis, size: int, spp: int, progress: Progress
) -> Any:
    """Figure 12: a row for every pair of files, with what lies between their codes.

    Parameters
    ----------
    files
        Materials or codes; the first belongs to the second, the third to the fourth, and so on.
    basis
        Of the codes.
    size
        Pixels along an edge of a picture.
    spp
        Samples per pixel.
    progress
        Called as it goes on.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    NacreError
        If a file cannot be read, or their number is odd.
    MissingExtraError
        If Mitsuba or Matplotlib is not installed.
    """
    if len(files) % 2:
        raise NacreError(f"fig12 takes pairs of materials, got {len(files)}")
    ends = coded(files, basis, progress)
    cell, rows = _SIDE + _GAP, len(files) // 2
    page = Page((2 * _NAMES + COUNT * cell - _GAP, rows * cell + _GAP))
    for row in range(rows):
        y = _GAP + row * cell
        materials = between(ends[2 * row], ends[2 * row + 1], COUNT)
        for column, material in enumerate(materials):
            page.image(_NAMES + column * cell, y, _SIDE, displayed(material, size, spp))
            progress("rendering", COUNT * row + column + 1, COUNT * rows, "")
        style = {"va": "center", "fontsize": 8}
        middle = y + 0.5 * _SIDE
        page.text(_NAMES - _GAP, middle, broken(files[2 * row].stem), ha="right", **style)
        page.text(page.width - _NAMES + _GAP, middle, broken(files[2 * row + 1].stem), **style)
    return page.figure
