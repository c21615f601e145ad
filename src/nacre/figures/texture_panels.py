"""Pictures of a texture at some pairs of directions, each under what its directions are."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf, Indices
from nacre.color import tone_map
from nacre.errors import require
from nacre.figures.drawing import FAINT, INK, Bytes, blank_page, display_bytes, draw_text
from nacre.figures.texture_views import reduced_pictures
from nacre.geometry import split, to_spherical

SMALL = 256
"""Longest edge in pixels up to which small pictures are enlarged."""

_NARROWEST, _GAP, _MARGIN, _HEADER, _CAPTION = 176, 16, 24, 68, 40


def texture_panels(btf: Btf, pairs: Indices, columns: int) -> Bytes:
    """Draw a texture at some pairs of directions; reflectance of 1 is white.

    Parameters
    ----------
    btf
        Any texture.
    pairs
        Which, shape (n,).
    columns
        Pictures in a row.

    Returns
    -------
    array of shape (height, width, 3)
        sRGB bytes.

    Raises
    ------
    MissingExtraError
        If Pillow is not installed.
    """
    panels = [enlarged(display_bytes(tone_map(p))) for p in reduced_pictures(btf, pairs)]
    height, across = panels[0].shape[:2]
    cell = max(across, _NARROWEST)
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    canvas = require("PIL.Image", "render")
    width = 2 * _MARGIN + columns * (cell + _GAP) - _GAP
    tall = _HEADER + rows * (_CAPTION + height + _GAP) - _GAP + _MARGIN
    image, draw = blank_page(width, tall)
    limit = width - 2 * _MARGIN
    draw_text(draw, (_MARGIN, 34), btf.name, 20, INK, limit=limit)
    note = f"{texels(btf, height, across)}; reflectance of 1 is white"
    draw_text(draw, (_MARGIN, 56), note, 13, FAINT, limit=limit)
    for index, (pair, panel) in enumerate(zip(pairs, panels, strict=True)):
        row, column = divmod(index, columns)
        x = _MARGIN + column * (cell + _GAP)
        y = _HEADER + row * (_CAPTION + height + _GAP)
        for line, direction in enumerate(angles(btf, int(pair))):
            draw_text(draw, (x, y + 15 + 17 * line), direction, 13, INK)
        image.paste(canvas.fromarray(panel), (x, y + _CAPTION))
    return np.array(image)


def texels(btf: Btf, height: int, width: int) -> str:
    """The size of a texture in words, and how it is shown in a picture of some pixels."""
    size = f"{btf.width:,} x {btf.height:,} texels"
    step = max(-(-btf.width // width), -(-btf.height // height))
    return size if step == 1 else f"{size}, {step} x {step} a pixel"


def angles(btf: Btf, pair: int) -> tuple[str, str]:
    """Light and view of a pair in words: polar angles and azimuths in degrees."""
    light, view = (_angles(w[pair]) for w in (btf.wi, btf.wo))
    return f"Light: {light}", f"View: {view}"


def _angles(direction: Floats) -> str:
    theta, phi = (round(float(np.degrees(a)), 1) for a in to_spherical(split(direction)))
    return f"theta {theta:g}°, phi {phi % 360.0 if theta else 0.0:g}°"


def enlarged(pixels: Any) -> Any:
    """A small picture with each pixel as large as makes it :data:`SMALL` at the most."""
    factor = max(1, SMALL // max(pixels.shape[:2]))
    return pixels.repeat(factor, axis=0).repeat(factor, axis=1)
