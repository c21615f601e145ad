"""A texel of a texture, or the mean of all, as a reflectance."""

from __future__ import annotations

import math

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.measured.scattered import ScatteredBrdf
from nacre.runtime.progress import Progress, silent
from nacre.textures.uniform import average


def texel_index(name: object, width: int, height: int, texel: tuple[int, int]) -> int:
    """Index of the texel in a column and a row, from 0; a NacreError if there is none."""
    x, y = texel
    if x >= width or y >= height:
        raise NacreError(
            f"{name}: has {width} x {height} texels, none in column {x}, row {y} (counted from 0)"
        )
    return y * width + x


def texture_reflectance(
    texture: Btf, texel: tuple[int, int] | None = None, progress: Progress = silent
) -> Brdf:
    """The apparent BRDF of a texel, interpolated between the directions of the texture.

    Parameters
    ----------
    texture
        Measured or encoded.
    texel
        Column and row, from 0; the mean of all texels if None.

    Raises
    ------
    NacreError
        If there is no such texel.
    """
    if texel is None:
        values = average(texture, progress).texels(slice(0, 1))[0]
    else:
        index = texel_index(texture.name, texture.width, texture.height, texel)
        values = texture.texels(slice(index, index + 1))[0]
    above = (texture.wi[:, 2] > 0.0) & (texture.wo[:, 2] > 0.0)
    rgb = values[above] / math.pi
    return ScatteredBrdf(texture.wi[above], texture.wo[above], rgb, texture.name, isotropic=False)
