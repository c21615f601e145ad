"""The compiled loops between reflectance and luma and chroma."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.compile.numba_code import compiled
from nacre.numerics.channels import CHROMA, LUMA

_LUMA, _DIFFERENCE, _SUM = np.float32(LUMA), CHROMA[0, 0], CHROMA[1, 0]
_NONE, _ALL = np.float32(0.0), np.float32(1.0)


@compiled
def split(rgb: Any, mean: Any, luma: Any, chroma: Any) -> None:
    """See :func:`nacre.textures.codecs.basis.colors.split_reflectance`."""
    for texel in range(rgb.shape[0]):
        for entry in range(rgb.shape[1]):
            red = np.float32(math.sqrt(max(rgb[texel, entry, 0], _NONE)))
            green = np.float32(math.sqrt(max(rgb[texel, entry, 1], _NONE)))
            blue = np.float32(math.sqrt(max(rgb[texel, entry, 2], _NONE)))
            luma[texel, entry] = _LUMA * (red + green + blue) - mean[entry]
            chroma[0, texel, entry] = _DIFFERENCE * (red - green)
            chroma[1, texel, entry] = _SUM * (red + green - blue - blue)


@compiled
def join(luma: Any, chroma: Any, rgb: Any) -> None:
    """See :func:`nacre.textures.codecs.basis.colors.join_reflectance`."""
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
