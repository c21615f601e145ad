"""One picture of two textures under some lights from some views, and where they differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.errors import require
from nacre.figures.drawing import (
    FAINT,
    INK,
    RULE,
    Bytes,
    blank_page,
    display_bytes,
    draw_scale,
    draw_text,
    magma,
    scale_end,
)
from nacre.figures.texture_panels import SMALL, angles, enlarged, texels
from nacre.figures.texture_views import reduced
from nacre.measured.textures.directions import from_degrees
from nacre.metrics.texture_comparison import matched
from nacre.textures.selection import nearest_pair

SHOWN = (
    ((0.0, 0.0), (0.0, 0.0)),
    ((45.0, 0.0), (0.0, 0.0)),
    ((45.0, 0.0), (45.0, 180.0)),
    ((75.0, 90.0), (30.0, 180.0)),
    ((60.0, 90.0), (60.0, 270.0)),
)
"""Polar angle and azimuth of the light, then of the view, in degrees."""

_LARGEST = 512
"""Pixels of an edge of a picture."""
_GAP, _MARGIN, _HEADER, _LABEL, _FOOTER = 20, 36, 108, 34, 76


def texture_sheet(truth: Btf, other: Btf, names: tuple[str, str] = ("truth", "other")) -> Bytes:
    """Draw two textures at the measured pairs of directions nearest to :data:`SHOWN`.

    Columns are the truth, the other, and the largest absolute difference of the channels. Pictures
    of more than 512 pixels a side are reduced by means over squares of pixels; small ones are
    enlarged without smoothing. No pair is shown twice. Each row has an exposure of its own, so that
    the brightest texels of the truth but one in a hundred are white; differences are relative to
    the same white.

    Parameters
    ----------
    truth, other
        Textures that :func:`nacre.metrics.texture_comparison.matched` takes.
    names
        What they are called.

    Returns
    -------
    array of shape (height, width, 3)
        sRGB bytes.

    Raises
    ------
    NacreError
        If they do not fit.
    MissingExtraError
        If Pillow is not installed.
    """
    other = matched(truth, other)
    wanted = [nearest_pair(truth, from_degrees(*wi), from_degrees(*wo)) for wi, wo in SHOWN]
    pairs = np.array(list(dict.fromkeys(wanted)))
    rows = [_row(truth, other, int(pair)) for pair in pairs]
    scale = scale_end(row.difference for row in rows)

    canvas = require("PIL.Image", "render")
    size = enlarged(rows[0].difference).shape
    cell = max(SMALL, size[1])
    width = 2 * _MARGIN + 3 * cell + 2 * _GAP
    height = _HEADER + len(rows) * (_LABEL + size[0]) + _FOOTER
    image, draw = blank_page(width, height)
    columns = [_MARGIN + i * (cell + _GAP) for i in range(3)]
    right = width - _MARGIN
    draw_text(draw, (_MARGIN, 42), names[1], 26, INK, limit=right - _MARGIN)
    subtitle = f"against {names[0]}; {texels(truth, *size)}"
    draw_text(draw, (_MARGIN, 70), subtitle, 16, FAINT, limit=right - _MARGIN)
    decoded = "Decoded" if other.decodable else "Other"
    titles = "Reference", decoded, "Error / white"
    for x, title in zip(columns, titles, strict=True):
        draw_text(draw, (x + cell / 2, _HEADER - 8), title, 15, INK, anchor="ms")
    y = _HEADER
    for row in rows:
        draw.line([(_MARGIN, y + 2), (right, y + 2)], fill=RULE)
        draw_text(draw, (_MARGIN, y + 24), row.label, 15, INK)
        draw_text(draw, (right, y + 24), f"white is {row.white:.3g}", 15, FAINT, anchor="rs")
        y += _LABEL
        pictures = tone_map(row.truth), tone_map(row.other), magma(row.difference / scale)
        for x, picture in zip(columns, pictures, strict=True):
            panel = canvas.fromarray(enlarged(display_bytes(picture)))
            image.paste(panel, (x + (cell - size[1]) // 2, y))
        y += size[0]
    note = "Error: the largest absolute difference of the channels, in units of the row's white"
    draw_text(draw, (_MARGIN, y + 36), note, 13, FAINT, limit=columns[2] - _GAP - _MARGIN)
    draw_scale(image, draw, (columns[2], y + 22), cell, scale)
    return np.array(image)


@dataclass(frozen=True)
class _Row:
    """Pictures relative to a white of their own, shape (height, width, 3), and where they differ.

    The difference has shape (height, width); it is found before pictures are reduced.
    """

    label: str
    truth: Floats
    other: Floats
    difference: Floats
    white: float


def _row(truth: Btf, other: Btf, pair: int) -> _Row:
    a, b = (texture.images(np.array([pair]))[0] for texture in (truth, other))
    white = max(float(np.percentile(a.max(-1), 99.0)), 1e-4)
    difference = np.abs(b - a).max(-1)
    a, b, difference = (reduced(values / white, _LARGEST) for values in (a, b, difference))
    return _Row("     ".join(angles(truth, pair)), a, b, difference, white)
