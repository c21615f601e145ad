"""Figures 11 and 12: a map of codes, and materials between codes."""

from __future__ import annotations

from dataclasses import dataclass

from nacre.errors import NacreError
from nacre.figures.code_views import between, coded, displayed, draw_map
from nacre.figures.page import Page
from nacre_lab.reproduce.chart import broken
from nacre_lab.reproduce.experiment import Experiment, Outcome, Request

COUNT = 5
"""Materials in a row of Figure 12, including both ends."""

_SIDE, _GAP, _NAMES = 1.2, 0.08, 1.4
"""Inches: edge of a picture, between two, and width of the names on either side."""


@dataclass(frozen=True, kw_only=True)
class CodeMap(Experiment):
    """The t-SNE map of codes; materials that the basis was not trained on are ringed in red."""

    heeds: frozenset[str] = frozenset(("basis", "seed"))

    def run(self, name: str, request: Request) -> Outcome:
        basis = request.find_basis()
        known = basis.metadata.get("materials")
        if not isinstance(known, list):
            raise NacreError("the basis does not say which materials it was trained on")
        materials = coded(request.files, basis, request.progress)
        names = [path.stem for path in request.files]
        new = [n for n, m in zip(names, materials, strict=True) if m.name not in known]
        page = draw_map(names, materials, new, request.seed, request.progress)
        note = f"{len(names)} materials, {len(new)} that the basis was not trained on"
        return Outcome({"": page}, note=note)


@dataclass(frozen=True, kw_only=True)
class CodeRows(Experiment):
    """One row for each pair of files: first and second, third and fourth, and so on."""

    heeds: frozenset[str] = frozenset(("basis", "quick"))

    def run(self, name: str, request: Request) -> Outcome:
        files, progress = request.files, request.progress
        size, spp = (64, 16) if request.quick else (192, None)
        basis = request.find_basis()
        if len(files) % 2:
            raise NacreError(f"{name} takes pairs of materials, got {len(files)}")
        ends = coded(files, basis, progress)
        cell, rows = _SIDE + _GAP, len(files) // 2
        page = Page(2 * _NAMES + COUNT * cell - _GAP, rows * cell + _GAP)
        for row in range(rows):
            y = _GAP + row * cell
            materials = between(ends[2 * row], ends[2 * row + 1], COUNT)
            for column, material in enumerate(materials):
                x = _NAMES + column * cell
                page.image(x, y, _SIDE, _SIDE, displayed(material, size, spp))
                progress("rendering", COUNT * row + column + 1, COUNT * rows, "")
            left, right = (broken(path.stem) for path in files[2 * row : 2 * row + 2])
            middle = y + 0.5 * _SIDE
            page.text(_NAMES - _GAP, middle, left, va="center", ha="right")
            page.text(page.width - _NAMES + _GAP, middle, right, va="center")
        return Outcome({"": page.figure}, note=f"{len(files)} materials")


_CODES = "codes from the given basis, found by `nacre latent encode`; the given materials; "
FIG11 = CodeMap(
    title="a map of codes",
    differs=f"{_CODES}materials whose names the basis was not trained on are ringed",
)
FIG12 = CodeRows(
    title="materials between two codes",
    differs=f"{_CODES}the ball of `nacre render` instead of the paper's scene",
)
