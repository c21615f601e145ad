"""Figures 4 and 8: measured and decoded textures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.color import tone_map
from nacre.figures.page import FAINT, Figure, Page
from nacre.measured.textures.directions import from_degrees
from nacre.textures.selection import nearest_pair
from nacre_lab.reproduce.chart import broken
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import markdown_table, scaled
from nacre_lab.reproduce.textures.materials import Material
from nacre_lab.reproduce.textures.methods import Method
from nacre_lab.reproduce.textures.sampling import ALL, FRACTIONS, Sampling
from nacre_lab.reproduce.textures.study import Study
from nacre_lab.reproduce.textures.table import error_table

TRUTH = "truth"
"""Title of the column for the measurement."""
_SIDE, _GAP, _NAMES, _HEAD, _CAPTION = 1.35, 0.08, 1.05, 0.4, 0.2
"""Inches: edge of a texture, space between, width of names, height of titles and captions."""
_BRIGHT, _WHITE = 99.0, 0.9
"""Percentile of the truth shown at a given brightness."""
ANGLES = {
    "fig4": ((45.0, 0.0), (60.0, 90.0)),
    "fig8": ((45.0, 0.0), (0.0, 0.0)),
    "fig9": ((0.0, 0.0), (60.0, 270.0)),
    "fig10": ((0.0, 0.0), (60.0, 270.0)),
}
"""Polar angle and azimuth in degrees of view and light. The paper gives azimuths and elevations of
them, 0, 45, 90, 30 and 0, 45, 0, 90 and 0, 90, 270, 30 degrees: its elevations are angles to the
surface, as 90 of the light of Figure 8 can only be the normal, and no direction at the horizon was
measured. It gives none of the corners of Figure 10; they are as Figure 9."""
_PARTS = tuple(s for s in FRACTIONS if s.name in ("1 %", "5 %", "10 %", "20 %", "50 %", "100 %"))


def fig4(study: Study, methods: Sequence[Method]) -> Outcome:
    """Unseen textures, measured and decoded by each method."""
    rows: list[Sequence[object]] = []
    lines, whole = [], dict[str, dict[str, float]]()
    for material in study.unseen:
        pair, truth = measured_pair(material, "fig4")
        line = [Cell(truth)]
        for method in methods:
            picture = study.picture(method, material, pair)
            cell = compared(study, method, material, truth, picture)
            line.append(cell)
            if cell.mse is not None and cell.whole is not None:
                rows.append((material.name, method.name, cell.mse, cell.whole))
                whole.setdefault(method.name, {})[material.name] = cell.whole
        lines.append(line)
    names = [material.name for material in study.unseen]
    page = cell_page([TRUTH, *(method.name for method in methods)], names, lines)
    columns = ("material", "method", "mse of the picture", "mse of all pairs")
    return Outcome({"": page}, columns, rows, error_table(names, whole))


def fig8(study: Study, methods: Sequence[Method]) -> Outcome:
    """Unseen textures encoded from some of their pairs, one page per method."""
    rows: list[Sequence[object]] = []
    pages: dict[str, Any] = {}
    table: list[list[str]] = []
    for method in methods:
        lines = []
        for material in study.unseen:
            pair, truth = measured_pair(material, "fig8")
            decoded = [(study.picture(method, material, pair, part), part) for part in _PARTS]
            cells = [compared(study, method, material, truth, *each) for each in decoded]
            lines.append([*cells, Cell(truth)])
            table.append([f"{method.name}, {material.name}", *(scaled(c.whole) for c in cells)])
            for part, cell in zip(_PARTS, cells, strict=True):
                if cell.mse is not None:
                    rows.append((material.name, method.name, part.name, cell.mse, cell.whole))
        heads = [*(part.name for part in _PARTS), TRUTH]
        if any(cell.mse is not None for line in lines for cell in line):
            pages[method.name] = cell_page(heads, [m.name for m in study.unseen], lines)
    columns = ("material", "method", "pairs seen", "mse of the picture", "mse of all pairs")
    head = ["MSE x 10⁴", *(part.name for part in _PARTS)]
    return Outcome(pages, columns, rows, markdown_table(head, table))


def measured_pair(material: Material, name: str) -> tuple[int, Floats]:
    """The measured pair nearest to the angles of a figure, and the picture there."""
    view, light = (from_degrees(*angles) for angles in ANGLES[name])
    texture = material.load()
    pair = nearest_pair(texture, light.astype(np.float32), view.astype(np.float32))
    return pair, texture.images(np.array([pair]))[0]


def compared(
    study: Study,
    method: Method,
    material: Material,
    truth: Floats,
    picture: Floats | None,
    sampling: Sampling = ALL,
) -> Cell:
    """A picture decoded by a method, if possible, and the errors."""
    found = study.errors(method, material, sampling)
    if picture is None or found is None:
        return Cell(None)
    return Cell(picture, float(np.square(picture - truth).mean()), found.mse)


@dataclass(frozen=True)
class Cell:
    """A picture, and the errors of it and the whole texture; none for the truth."""

    picture: Floats | None
    mse: float | None = None
    whole: float | None = None

    @property
    def caption(self) -> str:
        """The errors."""
        return "" if self.mse is None else f"{scaled(self.mse)} (all {scaled(self.whole)})"


def exposure_of(picture: Floats) -> float:
    """Exposure at which a measured picture is shown well."""
    return _WHITE / max(float(np.percentile(picture, _BRIGHT)), 1e-6)


def cell_page(
    heads: Sequence[str],
    names: Sequence[str],
    lines: Sequence[Sequence[Cell]],
    *,
    side: float = _SIDE,
    exposed: bool = False,
) -> Figure:
    """Pictures of materials in rows, `side` inches wide each, below heads: one is :data:`TRUTH`.

    If `exposed`, 1 is white; else the brightness of each row suits the truth.
    """
    across, down = side + _GAP, side + _CAPTION
    page = Page(_NAMES + len(heads) * across, _HEAD + len(lines) * down + _GAP)
    truth = heads.index(TRUTH)
    for column, head in enumerate(heads):
        x = _NAMES + column * across + 0.5 * side
        page.text(x, _HEAD - 0.08, head, ha="center", va="bottom", size=8.0)
    for row, (name, line) in enumerate(zip(names, lines, strict=True)):
        y = _HEAD + row * down
        page.text(0.05, y + 0.5 * side, broken(name, 12), va="center", size=8.0)
        measured = line[truth].picture
        assert measured is not None
        exposure = 1.0 if exposed else exposure_of(measured)
        for column, cell in enumerate(line):
            x = _NAMES + column * across
            if cell.picture is None:
                page.text(x + 0.5 * side, y + 0.5 * side, "none", ha="center", color=FAINT)
                continue
            page.image(x, y, side, side, tone_map(exposure * cell.picture), smooth=False)
            page.text(x, y + side + 0.03, cell.caption, 7.0, va="top", limit=side)
    return page.figure
