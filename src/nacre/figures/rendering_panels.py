"""Renderings of a texture beside those of a reference, and where they differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from nacre.array import Floats
from nacre.figures.difference_sheet import CELL_PIXELS, Row, difference_sheet, sheet_size
from nacre.figures.page import Bytes, scale_end

_NOTES = 2
"""Lines below the pictures."""


def difference(truth: Floats, other: Floats) -> Floats:
    """The largest absolute difference of the channels of linear pictures, clipped to [0, 1]."""
    return np.asarray(np.abs(np.clip(other, 0.0, 1.0) - np.clip(truth, 0.0, 1.0)).max(-1))


def panels_size(size: int) -> tuple[int, int]:
    """Width and height in pixels of what is drawn of square renderings of some pixels an edge."""
    return sheet_size(size, _NOTES, max(size, CELL_PIXELS))


def rendering_panels(
    truths: Sequence[Floats],
    others: Sequence[Floats],
    names: tuple[str, str] = ("truth", "other"),
    note: str = "",
) -> Iterator[Bytes]:
    """Draw linear renderings of one scene, or of its frames, beside those of a reference, as bytes.

    From left to right the reference, the model, and :func:`difference`, whose color scale is the
    same in all frames. Small renderings are enlarged without smoothing, others keep their pixels.
    Below is a note, a line of figures.
    """
    rows = [Row(a, b, difference(a, b)) for a, b in zip(truths, others, strict=True)]
    scale = scale_end(row.error for row in rows)
    meaning = f"Difference: the largest of the channels; white is 1, colors end at {scale:g}"
    for row in rows:
        cell = max(CELL_PIXELS, *row.error.shape)
        yield difference_sheet([row], scale, "Difference", names, (note, meaning), cell)
