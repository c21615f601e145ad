"""Pictures of a texture at some pairs of directions, small enough to be laid out as one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf, Indices
from nacre.measured.textures.directions import from_degrees
from nacre.textures.selection import nearest_pair

_CELL = 256
"""Most pixels of an edge of a picture among several."""

Angles = Sequence[tuple[float, float]]
"""Polar angles and azimuths in degrees."""


def nearest_pairs(btf: Btf, lights: Angles, views: Angles) -> Indices:
    """The pairs of directions nearest to each light (columns) and view (rows)."""
    return np.array(
        [[nearest_pair(btf, from_degrees(*wi), from_degrees(*wo)) for wi in lights] for wo in views]
    )


def reduced_pictures(btf: Btf, pairs: Indices) -> Floats:
    """Pictures at pairs of directions, reduced one by one to at most 256 pixels a side.

    Parameters
    ----------
    btf
        Any texture.
    pairs
        Which, any shape; where there is but one, it keeps its size.

    Returns
    -------
    array
        Shape (*pairs.shape, height, width, 3).
    """
    most = max(btf.width, btf.height) if pairs.size == 1 else _CELL
    shown, which = np.unique(pairs, return_inverse=True)
    pictures = np.stack([reduced(btf.images(np.array([pair]))[0], most) for pair in shown])
    return pictures[which.reshape(pairs.shape)]


def laid_out(pictures: Floats) -> Floats:
    """One picture of rows and columns of them, shape (rows, columns, height, width, 3)."""
    rows, columns, height, width, channels = pictures.shape
    return pictures.swapaxes(1, 2).reshape(rows * height, columns * width, channels)


def in_rows(pictures: Floats, columns: int) -> Floats:
    """Pictures (n, height, width, 3) as rows of some, for :func:`laid_out`; the rest is black."""
    rows = -(-len(pictures) // columns)
    whole = np.zeros((rows * columns, *pictures.shape[1:]), pictures.dtype)
    whole[: len(pictures)] = pictures
    return whole.reshape(rows, columns, *pictures.shape[1:])


def reduced(picture: Floats, most: int) -> Floats:
    """A picture of at most as many pixels a side: means over squares of some, or as it is.

    Squares at the right and below are cut by the edge. Any last axes, as that of channels, stay.
    """
    step = math.ceil(max(picture.shape[:2]) / most)
    for axis in (0, 1) if step > 1 else ():
        starts = np.arange(0, picture.shape[axis], step)
        counts = np.diff(starts, append=picture.shape[axis]).astype(picture.dtype)
        sums = np.moveaxis(np.add.reduceat(picture, starts, axis), axis, -1)
        picture = np.moveaxis(sums / counts, -1, axis)
    return picture
