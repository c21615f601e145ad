"""One picture of two textures under some lights from some views, and where they differ."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf.comparison import matched
from nacre.btf.directions import from_degrees
from nacre.btf.selection import nearest_pair
from nacre.btf.texture import Btf
from nacre.color import tone_map
from nacre.evaluate.drawing import (
    FAINT,
    INK,
    PAPER,
    RULE,
    Bytes,
    display_bytes,
    draw_scale,
    draw_text,
    magma,
)
from nacre.files import require
from nacre.geometry import split, to_spherical

SHOWN = (
    ((0.0, 0.0), (0.0, 0.0)),
    ((45.0, 0.0), (0.0, 0.0)),
    ((45.0, 0.0), (45.0, 180.0)),
    ((75.0, 90.0), (30.0, 180.0)),
    ((60.0, 90.0), (60.0, 270.0)),
)
"""Polar angle and azimuth of the light, then of the view, in degrees."""

_CELL, _GAP, _MARGIN, _HEADER, _LABEL, _FOOTER = 256, 20, 36, 108, 34, 76
_SCALES = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Ends of the colour scale; the smallest that holds nearly all errors is taken."""


def texture_sheet(truth: Btf, other: Btf, names: tuple[str, str] = ("truth", "other")) -> Bytes:
    """Draw two textures at the measured pairs of directions nearest to :data:`SHOWN`.

    Columns are the truth, the other, and the largest absolute difference of the channels. Of a
    texture wider or higher than a cell the middle is shown; smaller ones are enlarged without
    smoothing. Each row has an exposure of its own, so that the brightest texels of the truth but
    one in a hundred are white; differences are relative to the same white.

    Parameters
    ----------
    truth, other
        Textures that :func:`nacre.btf.comparison.matched` takes.
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
    rows = [
        (
            _label(truth, int(pair)),
            _middle(truth.images(pair[None])[0]),
            _middle(other.images(pair[None])[0]),
        )
        for pair in pairs
    ]
    whites = [max(float(np.percentile(a.max(-1), 99.0)), 1e-4) for _, a, _ in rows]
    differences = [
        np.abs(b - a).max(-1) / white for (_, a, b), white in zip(rows, whites, strict=True)
    ]
    peak = max(float(np.percentile(difference, 99.5)) for difference in differences)
    scale = next((end for end in _SCALES if end >= peak), _SCALES[-1])

    canvas = require("PIL.Image", "render")
    width = 2 * _MARGIN + 3 * _CELL + 2 * _GAP
    height = _HEADER + len(rows) * (_LABEL + _CELL) + _FOOTER
    image = canvas.new("RGB", (width, height), PAPER)
    draw = require("PIL.ImageDraw", "render").Draw(image)
    columns = [_MARGIN + i * (_CELL + _GAP) for i in range(3)]
    right = width - _MARGIN
    draw_text(draw, (_MARGIN, 42), names[1], 26, INK, limit=right - _MARGIN)
    draw_text(draw, (_MARGIN, 70), f"against {names[0]}", 16, FAINT, limit=right - _MARGIN)
    titles = "Truth", "Other", "Difference / white"
    for x, title in zip(columns, titles, strict=True):
        draw_text(draw, (x + _CELL / 2, _HEADER - 8), title, 15, INK, anchor="ms")
    y = _HEADER
    for (label, a, b), white, difference in zip(rows, whites, differences, strict=True):
        draw.line([(_MARGIN, y + 2), (right, y + 2)], fill=RULE)
        draw_text(draw, (_MARGIN, y + 24), label, 15, INK)
        draw_text(draw, (right, y + 24), f"white is {white:.3g}", 15, FAINT, anchor="rs")
        y += _LABEL
        cells = tone_map(a / white), tone_map(b / white), magma(difference / scale)
        for x, cell in zip(columns, cells, strict=True):
            image.paste(_enlarged(canvas, cell), (x, y))
        y += _CELL
    draw_scale(image, draw, (columns[2], y + 22), _CELL, scale)
    return np.array(image)


def _label(btf: Btf, pair: int) -> str:
    angles = (
        "{:.0f}°, {:.0f}°".format(*(float(np.degrees(a)) for a in to_spherical(split(w[pair]))))
        for w in (btf.wi, btf.wo)
    )
    return "Light {}     view {}".format(*angles)


def _middle(picture: Floats) -> Floats:
    """The square in the middle, at most a cell wide."""
    height, width = picture.shape[:2]
    size = min(height, width, _CELL)
    top, left = (height - size) // 2, (width - size) // 2
    return picture[top : top + size, left : left + size]


def _enlarged(canvas: Any, values: npt.NDArray[Any]) -> Any:
    """A square picture in the middle of a cell, each pixel as large as it can be."""
    factor = math.floor(_CELL / len(values))
    pixels = display_bytes(values).repeat(factor, axis=0).repeat(factor, axis=1)
    cell = canvas.new("RGB", (_CELL, _CELL), PAPER)
    margin = (_CELL - len(pixels)) // 2
    cell.paste(canvas.fromarray(pixels), (margin, margin))
    return cell
