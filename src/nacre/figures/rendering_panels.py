"""Renderings of a texture beside those of a reference, and where they differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from nacre.array import Floats
from nacre.color import tone_map
from nacre.errors import require
from nacre.figures.drawing import (
    FAINT,
    INK,
    Bytes,
    blank_page,
    display_bytes,
    draw_scale,
    draw_text,
    magma,
    scale_end,
)
from nacre.figures.texture_panels import enlarged

_NARROWEST, _GAP, _MARGIN, _HEADER, _FOOTER = 200, 16, 24, 96, 68


def difference(truth: Floats, other: Floats) -> Floats:
    """The largest absolute difference of the channels of linear pictures, clipped to [0, 1]."""
    found: Floats = np.abs(np.clip(other, 0.0, 1.0) - np.clip(truth, 0.0, 1.0)).max(-1)
    return found


def panels_size(size: int) -> tuple[int, int]:
    """Width and height of what is drawn of square renderings of some pixels an edge."""
    shown = len(enlarged(np.zeros((size, 1), bool)))
    return 2 * (_MARGIN + _GAP) + 3 * max(shown, _NARROWEST), _HEADER + shown + _FOOTER


def rendering_panels(
    truths: Sequence[Floats],
    others: Sequence[Floats],
    names: tuple[str, str] = ("truth", "other"),
    note: str = "",
) -> Iterator[Bytes]:
    """Draw renderings of one scene, or of each of its frames, beside those of a reference.

    From left to right the truth, the other, and :func:`difference` on one scale of colors. Small
    ones are enlarged without smoothing.

    Parameters
    ----------
    truths, others
        Linear Rec. 709 RGB, each of shape (height, width, 3); 1 is white.
    names
        What they are called.
    note
        A line of figures, below.

    Yields
    ------
    array of shape (height, width, 3)
        sRGB bytes.

    Raises
    ------
    MissingExtraError
        If Pillow is not installed.
    """
    scale = scale_end(difference(*pair) for pair in zip(truths, others, strict=True))
    for truth, other in zip(truths, others, strict=True):
        yield _panels(truth, other, scale, names, note)


def _panels(truth: Floats, other: Floats, scale: float, names: tuple[str, str], note: str) -> Bytes:
    canvas = require("PIL.Image", "render")
    errors = magma(difference(truth, other) / scale)
    panels = [enlarged(display_bytes(p)) for p in (tone_map(truth), tone_map(other), errors)]
    height, across = panels[0].shape[:2]
    cell = max(across, _NARROWEST)
    columns = [_MARGIN + i * (cell + _GAP) for i in range(3)]
    right = columns[2] + cell
    image, draw = blank_page(right + _MARGIN, _HEADER + height + _FOOTER)
    draw_text(draw, (_MARGIN, 34), names[1], 20, INK, limit=right - _MARGIN)
    draw_text(draw, (_MARGIN, 56), f"against {names[0]}", 13, FAINT, limit=right - _MARGIN)
    for x, title, panel in zip(columns, ("Reference", "Rendered", "Error"), panels, strict=True):
        draw_text(draw, (x + cell / 2, _HEADER - 8), title, 15, INK, anchor="ms")
        image.paste(canvas.fromarray(panel), (x + (cell - across) // 2, _HEADER))
    y = _HEADER + height
    limit = columns[2] - _GAP - _MARGIN
    draw_text(draw, (_MARGIN, y + 24), note, 13, INK, limit=limit)
    meaning = "Error: largest absolute difference of the channels; white is 1"
    draw_text(draw, (_MARGIN, y + 46), meaning, 13, FAINT, limit=limit)
    draw_scale(image, draw, (columns[2], y + 10), cell, scale)
    return np.array(image)
