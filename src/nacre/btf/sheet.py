"""Pictures of a texture at some pairs of directions, small enough to be laid out as one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nacre.array import Floats
from nacre.btf.directions import from_degrees
from nacre.btf.selection import nearest_pair
from nacre.btf.texture import Btf, Indices

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
        Which, shape (rows, columns); where there is but one, it keeps its size.

    Returns
    -------
    array
        Shape (rows, columns, height, width, 3).
    """
    step = 1 if pairs.size == 1 else math.ceil(max(btf.width, btf.height) / _CELL)
    shown, which = np.unique(pairs, return_inverse=True)
    pictures = np.stack([_reduced(btf.images(np.array([pair]))[0], step) for pair in shown])
    return pictures[which.reshape(pairs.shape)]


def laid_out(pictures: Floats) -> Floats:
    """One picture of rows and columns of them, shape (rows, columns, height, width, 3)."""
    rows, columns, height, width, channels = pictures.shape
    return pictures.swapaxes(1, 2).reshape(rows * height, columns * width, channels)


def _reduced(picture: Floats, step: int) -> Floats:
    """Means over squares of pixels; those that are left at the right and below are cut off."""
    height, width = (n // step * step for n in picture.shape[:2])
    if not height or not width:
        return picture
    squares = picture[:height, :width].reshape(height // step, step, width // step, step, 3)
    mean: Floats = squares.mean(axis=(1, 3))
    return mean
