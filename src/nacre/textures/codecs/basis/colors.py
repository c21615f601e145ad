"""Reflectance to luma and chroma of the default codec, and back, in one pass each.

Both are those of square roots of reflectance, in the coordinates of :mod:`nacre.numerics.channels`.
Errors of a root count less where reflectance is small, so dark places keep their tone and hue; and
squares of sums are never below zero.
"""

from __future__ import annotations

import numpy as np

from nacre.array import Array, Components, Floats, namespace
from nacre.compile.compilation import Compiled
from nacre.numerics.channels import CHROMA, LUMA

_DIFFERENCE, _SUM = CHROMA[0, 0], CHROMA[1, 0]

_split = Compiled("nacre.textures.codecs.basis.color_loops:split")
_join = Compiled("nacre.textures.codecs.basis.color_loops:join")


def split_reflectance(rgb: Floats, mean: Floats) -> tuple[Floats, Floats]:
    """Luma less its mean, (b, n), and chroma, (2, b, n), of reflectance (b, n, 3).

    The mean has shape (n,). Reflectance below 0, as noise of a measurement may leave it, counts as
    0.
    """
    rgb = np.ascontiguousarray(rgb, np.float32)
    luma = np.empty(rgb.shape[:2], np.float32)
    chroma = np.empty((2, *luma.shape), np.float32)
    _split(rgb, mean, luma, chroma)
    return luma, chroma


def join_reflectance(luma: Floats, chroma: Floats, rgb: Floats) -> None:
    """Write reflectance (b, n, 3) for luma (b, n) and chroma (2, b, n).

    Where the root of a channel would be below 0, chroma is made smaller: luma stays, and dark
    places are not tinted as they would be if only that channel were changed.
    """
    _join(luma, chroma, rgb)


def join_components(luma: Array, first: Array, second: Array) -> Components:
    """What :func:`join_reflectance` does, on arrays of any library."""
    xp = namespace(luma, first, second)
    level = xp.maximum(LUMA * luma, 0.0)
    difference, total = float(_DIFFERENCE) * first, float(_SUM) * second
    red, green, blue = total + difference, total - difference, -2.0 * total
    lowest = xp.minimum(xp.minimum(red, green), blue)
    below = level + lowest < 0.0
    fraction = xp.where(below, level / xp.where(below, -1.0 * lowest, 1.0), 1.0)
    red, green, blue = (level + fraction * color for color in (red, green, blue))
    return red * red, green * green, blue * blue
