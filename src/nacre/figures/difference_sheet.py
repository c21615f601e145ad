"""Sheets of pictures in rows: a reference, a model, and their difference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.color import tone_map
from nacre.figures.page import FAINT, PAPER, Bytes, Page, enlarged, magma, scale_end

WIDTH, CELL_PIXELS = 8.0, 384
"""Width of a sheet in inches, and the least pixels along an edge of its cells."""

_NOTES = 2  # lines below renderings
_MARGIN, _GAP = 0.25, 0.15
_CELL = (WIDTH - 2 * _MARGIN - 2 * _GAP) / 3
_COLUMNS = tuple(_MARGIN + k * (_CELL + _GAP) for k in range(3))
# Heights in inches: titles with and without names, a row's label, below pictures, a note, the end.
_HEADER, _STRIP_HEADER, _LABEL, _BELOW, _LINE, _END = 0.95, 0.45, 0.34, 0.08, 0.2, 0.2


@dataclass(frozen=True)
class Row:
    """A row of three pictures.

    Parameters
    ----------
    reference, model
        Linear RGB, shape (height, width, 3); 1 is white.
    error
        Shape (height, width), in the unit of the color scale.
    label, note
        Above the row, left and right; if both are empty, they take no space.
    sphere
        Whether the pictures show the sphere (:mod:`nacre.mitsuba.sphere`).
    smooth
        Whether enlarging interpolates; otherwise a pixel stays a square.
    """

    reference: Floats
    model: Floats
    error: Floats
    label: str = ""
    note: str = ""
    sphere: bool = False
    smooth: bool = False

    def layout(self, cell: int) -> tuple[float, float]:
        """Width and height of its pictures in inches, in cells with some pixels."""
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
    """Draw rows of pictures below column titles, as sRGB bytes.

    Parameters
    ----------
    scale
        Error at the bright end of the color scale.
    error
        Title of the third column.
    names
        Files of the reference and the model; if both are empty, there is no space for them.
    notes
        Lines of text below.
    cell
        Pixels along a cell's edge, at least those of any picture that is not smooth.
    titles
        For the first two columns.
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
        where = f"0 to {scale:g} here"
        page.text(_COLUMNS[2] + _CELL, y, where, 8.0, FAINT, ha="right")
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


def difference(truth: Floats, other: Floats) -> Floats:
    """Largest absolute difference of the channels of linear pictures clipped to [0, 1]."""
    return np.asarray(np.abs(np.clip(other, 0.0, 1.0) - np.clip(truth, 0.0, 1.0)).max(-1))


def panels_size(size: int) -> tuple[int, int]:
    """Width and height in pixels of :func:`rendering_panels` for square renderings."""
    cell = max(size, CELL_PIXELS)
    tall = _CELL * (cell // size) * size / cell
    height = _HEADER + _GAP + _BELOW + tall + _LINE * _NOTES + _END
    dpi = cell / _CELL
    return round(WIDTH * dpi), round(height * dpi)


def rendering_panels(
    truths: Sequence[Floats],
    others: Sequence[Floats],
    names: tuple[str, str] = ("truth", "other"),
    note: str = "",
) -> Iterator[Bytes]:
    """Draw linear renderings of one scene, or of its frames, beside those of a reference, as bytes.

    From left to right: the reference, the model, and :func:`difference`, whose color scale is the
    same in all frames. Small renderings are enlarged without smoothing, others keep their pixels.
    The note below is a line of numbers.
    """
    rows = [Row(a, b, difference(a, b)) for a, b in zip(truths, others, strict=True)]
    scale = scale_end(row.error for row in rows)
    meaning = f"Difference: the largest of the channels; white is 1, colors end at {scale:g}"
    for row in rows:
        cell = max(CELL_PIXELS, *row.error.shape)
        yield difference_sheet([row], scale, "Difference", names, (note, meaning), cell)
