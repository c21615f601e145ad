"""A sheet of rows, each a reference, a model of it, and where they differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nacre.array import Floats
from nacre.color import tone_map
from nacre.figures.page import FAINT, PAPER, Bytes, Page, enlarged, magma

WIDTH, CELL_PIXELS = 8.0, 384
"""Width of a sheet in inches, and pixels of its cells where a sheet does not ask for more."""

_MARGIN, _GAP = 0.25, 0.15
_CELL = (WIDTH - 2 * _MARGIN - 2 * _GAP) / 3
_COLUMNS = tuple(_MARGIN + k * (_CELL + _GAP) for k in range(3))
_HEADER, _STRIP_HEADER, _LABEL, _BELOW, _LINE, _END = 0.95, 0.45, 0.34, 0.08, 0.2, 0.2
"""Inches: heights of titles, of those of a strip, of a row's label, below pictures, of a note, of
the end."""


@dataclass(frozen=True)
class Row:
    """A row of three pictures.

    Parameters
    ----------
    reference, model
        Linear RGB, shape (height, width, 3); 1 is white.
    error
        Shape (height, width), in what the color scale is in.
    label, note
        Above the row, to the left and to the right; no room is left where both are empty.
    sphere
        Whether the pictures are of the sphere (:mod:`nacre.render.sphere`).
    smooth
        Whether they are interpolated where they are enlarged; if not, a pixel stays a square.
    """

    reference: Floats
    model: Floats
    error: Floats
    label: str = ""
    note: str = ""
    sphere: bool = False
    smooth: bool = False

    def layout(self, cell: int) -> tuple[float, float]:
        """Width and height of its pictures in inches, in cells of some pixels."""
        height, width = self.reference.shape[:2]
        if self.sphere or self.smooth:
            longest = max(height, width)
            return _CELL * width / longest, _CELL * height / longest
        factor = max(1, cell // max(height, width))
        return _CELL * factor * width / cell, _CELL * factor * height / cell


def difference_sheet(
    rows: Sequence[Row],
    scale: float,
    error: str,
    names: tuple[str, str] = ("", ""),
    notes: Sequence[str] = (),
    cell: int = CELL_PIXELS,
    titles: tuple[str, str] = ("Reference", "Model"),
) -> Bytes:
    """Draw rows of pictures below two titles and that of the error, as sRGB bytes.

    Parameters
    ----------
    rows
        From top to bottom.
    scale
        Error at the bright end of the color scale.
    error
        What the error is, in a few words.
    names
        Of the files of the reference and of the model; where both are empty, the page is a strip
        without room for them.
    notes
        Lines of text below.
    cell
        Pixels of a cell's edge, at least those of any picture that is not smooth.
    titles
        Of the first two columns.
    """
    header = _HEADER if any(names) else _STRIP_HEADER
    heights = [row.layout(cell)[1] + _above(row) + _BELOW for row in rows]
    height = header + sum(heights) + _LINE * len(notes) + _END
    page = Page(WIDTH, height, PAPER, cell / _CELL)
    y = 0.38
    for x, title in zip(_COLUMNS, (*titles, error), strict=True):
        page.text(x, y, title, 11.0, weight="bold", limit=_CELL)
    for x, name in zip(_COLUMNS, names, strict=False):
        page.text(x, y + 0.24, name, 9.0, FAINT, limit=_CELL)
    if any(names):
        page.error_scale(_COLUMNS[2], y + 0.13, _CELL, scale)
    y, right = header, WIDTH - _MARGIN
    for row, tall in zip(rows, heights, strict=True):
        width, high = row.layout(cell)
        top = y + _above(row)
        if row.label or row.note:
            page.line(_MARGIN, y, right, y)
            note = page.text(right, y + 0.21, row.note, 8.5, FAINT, ha="right")
            page.text(_MARGIN, y + 0.21, row.label, 9.5,
                      limit=right - _MARGIN - page.text_width(note) - 0.2)  # fmt: skip
        pictures = tone_map(row.reference), tone_map(row.model), magma(row.error / scale)
        for x, picture in zip(_COLUMNS, pictures, strict=True):
            left = x + 0.5 * (_CELL - width)
            if row.sphere:
                page.sphere(left, top, width, picture)
            elif row.smooth:
                page.image(left, top, width, high, picture)
            else:
                page.image(left, top, width, high, enlarged(picture, cell), smooth=False)
        y += tall
    for note_line in notes:
        y += _LINE
        page.text(_MARGIN, y, note_line, 8.5, FAINT, limit=right - _MARGIN)
    return page.pixels()


def _above(row: Row) -> float:
    return _LABEL if row.label or row.note else _GAP


def sheet_size(size: int, notes: int, cell: int) -> tuple[int, int]:
    """Width and height in pixels of a sheet of one row of square pictures, before it is drawn."""
    factor = max(1, cell // size)
    height = _HEADER + _GAP + _BELOW + _CELL * factor * size / cell + _LINE * notes + _END
    dpi = cell / _CELL
    return round(WIDTH * dpi), round(height * dpi)
