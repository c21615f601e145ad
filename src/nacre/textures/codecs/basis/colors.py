"""Reflectance to luma and chroma of the default codec, and back, in one pass each.

Both are those of square roots of reflectance, in the coordinates of :mod:`nacre.numerics.channels`.
Errors of a root count less where reflectance is small, so dark places keep their tone and hue; and
squares of sums are never below zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.array import Array, Components, Floats, namespace
from nacre.compile.compilation import compiled
from nacre.numerics.channels import CHROMA, LUMA

_LUMA, _DIFFERENCE, _SUM = np.float32(LUMA), CHROMA[0, 0], CHROMA[1, 0]
_NONE, _ALL = np.float32(0.0), np.float32(1.0)


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


@compiled
def _split(rgb: Any, mean: Any, luma: Any, chroma: Any) -> None:
    for texel in range(rgb.shape[0]):
        for entry in range(rgb.shape[1]):
            red = np.float32(math.sqrt(max(rgb[texel, entry, 0], _NONE)))
            green = np.float32(math.sqrt(max(rgb[texel, entry, 1], _NONE)))
            blue = np.float32(math.sqrt(max(rgb[texel, entry, 2], _NONE)))
            luma[texel, entry] = _LUMA * (red + green + blue) - mean[entry]
            chroma[0, texel, entry] = _DIFFERENCE * (red - green)
            chroma[1, texel, entry] = _SUM * (red + green - blue - blue)


@compiled
def join_reflectance(luma: Any, chroma: Any, rgb: Any) -> None:
    """Write reflectance (b, n, 3) for luma (b, n) and chroma (2, b, n).

    Where the root of a channel would be below 0, chroma is made smaller: luma stays, and dark
    places are not tinted as they would be if only that channel were changed.
    """
    for texel in range(luma.shape[0]):
        for entry in range(luma.shape[1]):
            level = max(_LUMA * luma[texel, entry], _NONE)
            difference = _DIFFERENCE * chroma[0, texel, entry]
            total = _SUM * chroma[1, texel, entry]
            red, green, blue = total + difference, total - difference, -total - total
            lowest = min(red, green, blue)
            fraction = _ALL if level + lowest >= _NONE else level / -lowest
            rgb[texel, entry, 0] = (level + fraction * red) ** 2
            rgb[texel, entry, 1] = (level + fraction * green) ** 2
            rgb[texel, entry, 2] = (level + fraction * blue) ** 2


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
