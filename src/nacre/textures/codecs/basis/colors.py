"""Reflectance to gray values and chroma of the default codec, and back, in one pass each.

They are those of square roots of reflectance, in the coordinates of :mod:`nacre.numerics.channels`.
Errors of a root count less where reflectance is small, so dark places keep their tone and hue; and
squares of sums are never below zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.array import Array, Components, Floats, namespace
from nacre.numerics.channels import CHROMA, LUMA
from nacre.runtime.compilation import compiled

_GREY, _DIFFERENCE, _SUM = np.float32(LUMA), CHROMA[0, 0], CHROMA[1, 0]
_NONE, _ALL = np.float32(0.0), np.float32(1.0)


def split_reflectance(rgb: Floats, mean: Floats) -> tuple[Floats, Floats]:
    """Gray values less their mean, (b, n), and chroma, (2, b, n), of reflectance (b, n, 3).

    The mean has shape (n,). Reflectance below 0, which noise of a measurement may leave, counts as
    0.
    """
    rgb = np.ascontiguousarray(rgb, np.float32)
    grey = np.empty(rgb.shape[:2], np.float32)
    chroma = np.empty((2, *grey.shape), np.float32)
    _split(rgb, mean, grey, chroma)
    return grey, chroma


@compiled
def _split(rgb: Any, mean: Any, grey: Any, chroma: Any) -> None:
    for texel in range(rgb.shape[0]):
        for entry in range(rgb.shape[1]):
            red = np.float32(math.sqrt(max(rgb[texel, entry, 0], _NONE)))
            green = np.float32(math.sqrt(max(rgb[texel, entry, 1], _NONE)))
            blue = np.float32(math.sqrt(max(rgb[texel, entry, 2], _NONE)))
            grey[texel, entry] = _GREY * (red + green + blue) - mean[entry]
            chroma[0, texel, entry] = _DIFFERENCE * (red - green)
            chroma[1, texel, entry] = _SUM * (red + green - blue - blue)


@compiled
def join_reflectance(grey: Any, chroma: Any, rgb: Any) -> None:
    """Write reflectance (b, n, 3) of gray values (b, n) and chroma (2, b, n).

    Where the root of a channel would be below 0, chroma is made smaller: the gray value stays, and
    dark places are not tinted as they would be if only that channel were changed.
    """
    for texel in range(grey.shape[0]):
        for entry in range(grey.shape[1]):
            level = max(_GREY * grey[texel, entry], _NONE)
            difference = _DIFFERENCE * chroma[0, texel, entry]
            total = _SUM * chroma[1, texel, entry]
            red, green, blue = total + difference, total - difference, -total - total
            lowest = min(red, green, blue)
            share = _ALL if level + lowest >= _NONE else level / -lowest
            rgb[texel, entry, 0] = (level + share * red) ** 2
            rgb[texel, entry, 1] = (level + share * green) ** 2
            rgb[texel, entry, 2] = (level + share * blue) ** 2


def join_components(grey: Array, first: Array, second: Array) -> Components:
    """What :func:`join_reflectance` does, on arrays of any library: a gray value and a pair."""
    xp = namespace(grey, first, second)
    level = xp.maximum(LUMA * grey, 0.0)
    difference, total = float(_DIFFERENCE) * first, float(_SUM) * second
    red, green, blue = total + difference, total - difference, -2.0 * total
    lowest = xp.minimum(xp.minimum(red, green), blue)
    below = level + lowest < 0.0
    share = xp.where(below, level / xp.where(below, -1.0 * lowest, 1.0), 1.0)
    red, green, blue = (level + share * color for color in (red, green, blue))
    return red * red, green * green, blue * blue
