"""Pictures of one texture at some pairs of directions, laid out on a sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf, Indices
from nacre.color import tone_map
from nacre.figures.page import DPI, FAINT, Bytes, Page, enlarged
from nacre.geometry import split, to_spherical
from nacre.measured.textures.directions import from_degrees
from nacre.textures.selection import nearest_pair

_CELL = 256  # the most pixels along an edge of a picture among several
_MIN_CELL = 160  # about the pixels that a picture without caption is enlarged to
# Inches: between cells, at the edges, and the heights of the title and a caption.
_GAP, _MARGIN, _HEADER, _CAPTION = 0.12, 0.2, 0.62, 0.4
# Polar angles and azimuths in degrees that `capture_sheet` shows.
_LIGHTS = ((0.0, 0.0), (45.0, 180.0), (45.0, 90.0), (75.0, 0.0))
_VIEWS = ((0.0, 0.0), (45.0, 0.0), (75.0, 90.0))

Angles = Sequence[tuple[float, float]]
"""Polar angles and azimuths in degrees."""


def texture_panels(btf: Btf, pairs: Indices, columns: int) -> Bytes:
    """Draw a texture at some pairs of directions, shape (n,), as bytes; reflectance 1 is white."""
    panels = [enlarged(tone_map(p), _CELL) for p in reduced_pictures(btf, pairs)]
    tall, wide = (n / DPI for n in panels[0].shape[:2])
    cell = max(wide, _CELL / DPI)
    across, down = cell + _GAP, _CAPTION + tall + _GAP
    columns = min(columns, len(panels))
    limit = columns * across - _GAP
    rows = -(-len(panels) // columns)
    page = Page(2 * _MARGIN + limit, _HEADER + rows * down - _GAP + _MARGIN)
    page.text(_MARGIN, 0.3, btf.name, 11.0, weight="bold", limit=limit)
    note = f"{texels(btf, *panels[0].shape[:2])}; reflectance of 1 is white"
    page.text(_MARGIN, 0.5, note, 8.5, FAINT, limit=limit)
    for index, (pair, panel) in enumerate(zip(pairs, panels, strict=True)):
        row, column = divmod(index, columns)
        x, y = _MARGIN + column * across, _HEADER + row * down
        for line, direction in enumerate(angles(btf, int(pair))):
            page.text(x, y + 0.16 + 0.17 * line, direction, 8.5, limit=cell)
        page.image(x, y + _CAPTION, wide, tall, panel, smooth=False)
    return page.pixels()


def capture_sheet(btf: Btf) -> Floats:
    """Linear pictures under four lights (columns) from three views (rows), tiled.

    Each uses the pair nearest to the wanted one, under a lamp with constant power that makes most
    of the first picture nearly white: reflectance times the light's cosine.
    """
    chosen = nearest_pairs(btf, _LIGHTS, _VIEWS)
    pictures = reduced_pictures(btf, chosen) * btf.wi[chosen, 2][..., None, None, None]
    bright = float(np.quantile(pictures[0, 0].max(-1), 0.9))
    pictures = np.tile(pictures * (0.8 / max(bright, 1e-3)), (1, 1, 2, 2, 1))
    factor = max(1, _MIN_CELL // pictures.shape[3])
    pictures = pictures.repeat(factor, 2).repeat(factor, 3)
    framed = np.pad(pictures, ((0, 0), (0, 0), (1, 1), (1, 1), (0, 0)), constant_values=1.0)
    return laid_out(framed)


def texels(btf: Btf, height: int, width: int) -> str:
    """The size of a texture in words, and its scale in a picture with some pixels."""
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


def nearest_pairs(btf: Btf, lights: Angles, views: Angles) -> Indices:
    """The pairs of directions nearest to each light (columns) and view (rows)."""
    return np.array(
        [[nearest_pair(btf, from_degrees(*wi), from_degrees(*wo)) for wi in lights] for wo in views]
    )


def reduced_pictures(btf: Btf, pairs: Indices) -> Floats:
    """Pictures, shape (*pairs.shape, height, width, 3), reduced to at most 256 pixels a side.

    The array of pairs may have any shape; a single picture keeps its size.
    """
    most = max(btf.width, btf.height) if pairs.size == 1 else _CELL
    shown, which = np.unique(pairs, return_inverse=True)
    pictures = np.stack([reduced(btf.images(np.array([pair]))[0], most) for pair in shown])
    return pictures[which.reshape(pairs.shape)]


def laid_out(pictures: Floats) -> Floats:
    """One picture from rows and columns, shape (rows, columns, height, width, 3)."""
    rows, columns, height, width, channels = pictures.shape
    return pictures.swapaxes(1, 2).reshape(rows * height, columns * width, channels)


def in_rows(pictures: Floats, columns: int) -> Floats:
    """Pictures (n, height, width, 3) in rows for :func:`laid_out`, filled up with black."""
    missing = -len(pictures) % columns
    whole = np.concatenate([pictures, np.zeros((missing, *pictures.shape[1:]), pictures.dtype)])
    return whole.reshape(-1, columns, *pictures.shape[1:])


def reduced(picture: Floats, most: int) -> Floats:
    """A picture reduced to at most `most` pixels a side by means over squares.

    Squares at the right and bottom are cut by the edge. Further axes, such as channels, stay.
    """
    step = math.ceil(max(picture.shape[:2]) / most)
    for axis in (0, 1) if step > 1 else ():
        starts = np.arange(0, picture.shape[axis], step)
        counts = np.diff(starts, append=picture.shape[axis]).astype(picture.dtype)
        sums = np.moveaxis(np.add.reduceat(picture, starts, axis), axis, -1)
        picture = np.moveaxis(sums / counts, -1, axis)
    return picture
