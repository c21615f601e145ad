"""An encoded texture as arrays of half floats for shaders, which mix texels by themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.array import Components, Floats
from nacre.brdf import Brdf
from nacre.btf import Btf, Indices
from nacre.errors import NacreError
from nacre.io.ktx2 import Pixels
from nacre.targets.textures.heights import HeightField
from nacre.targets.textures.shader_texture import (
    LARGEST,
    RESOLUTION,
    Halves,
    ShaderTexture,
    encoded,
    halves,
    layered,
    tiled,
)
from nacre.textures.factors import CHROMAS, LUMAS, factor, roots
from nacre.textures.latent_map import LatentMap
from nacre.textures.lobes import latent_lobes
from nacre.textures.mipmap import level_shapes

LUMA_LAYERS, CHROMA_LAYERS = LUMAS // 4, CHROMAS // 4
"""Layers of functions, four functions in each."""


@dataclass(frozen=True, eq=False)
class TextureAtlas(ShaderTexture):
    """The factors of a texture (:mod:`nacre.textures.factors`), and lobes for sampling.

    Parameters
    ----------
    height, width
        Size of the map.
    weights
        For texels of all levels, shape (layers, rows, columns, 4): luma, then the first and the
        second value of the chroma pair. Level 0 starts in the corner; the others lie in a strip
        along its longer side, see :func:`level_origin`.
    functions
        Luma, then chroma; they take 15 MB.
    lobes, heights
        See :class:`ShaderTexture`.
    """

    height: int
    width: int
    weights: Halves
    functions: Halves
    lobes: Halves
    heights: HeightField | None = None

    @classmethod
    def of(
        cls,
        material: Brdf | Btf | LatentMap,
        resolution: int = RESOLUTION,
        heights: HeightField | None = None,
    ) -> TextureAtlas:
        """The atlas of an encoded texture; `resolution` is that of the grid of directions.

        Raises NacreError if the texture is not encoded, its codec works for its own directions
        only, it is larger than :data:`LARGEST`, or half floats cannot hold it.
        """
        latent = encoded(material)
        height, width = latent.shape[:2]
        levels = len(level_shapes(height, width))
        rows, columns = atlas_shape(height, width)
        if max(rows, columns) > LARGEST:
            raise NacreError(
                f"{latent.name}: {width} x {height} texels with their mipmaps need an array of "
                f"{columns} x {rows}; the limit is {LARGEST} x {LARGEST}"
            )
        factors = factor(latent, resolution, levels)
        return cls(
            height,
            width,
            _packed(latent.name, factors.weights, height, width),
            tiled(latent.name, factors.functions, resolution),
            halves(latent.name, latent_lobes(latent)),
            heights,
        )

    def level_weights(self) -> list[Halves]:
        """Weights of each level, shape (rows, columns, numbers)."""
        pixels = self.weights.transpose(1, 2, 0, 3).reshape(*self.weights.shape[1:3], -1)
        found = []
        for level, (rows, columns) in enumerate(level_shapes(self.height, self.width)):
            top, left = level_origin(self.height, self.width, level)
            found.append(pixels[top : top + rows, left : left + columns])
        return found

    def weights_by_name(self) -> dict[str, tuple[Pixels, ...]]:
        return {"weights": (self.weights,)}

    def roots(self, texels: Indices, functions: Floats) -> Components:
        weights = self.level_weights()[0].reshape(-1, LUMAS + 2 * CHROMAS)
        return roots(weights[texels].astype(np.float32), functions, LUMAS)


def level_origin(height: int, width: int, level: int) -> tuple[int, int]:
    """Row and column where a level starts in the atlas.

    Levels after the first lie side by side along the longer side of the map: each starts where the
    one before would end if no size were rounded down.
    """
    if level == 0:
        return 0, 0
    if width >= height:
        return height, width - (width >> (level - 1))
    return height - (height >> (level - 1)), width


def atlas_shape(height: int, width: int) -> tuple[int, int]:
    """Rows and columns of a map's atlas."""
    shapes = level_shapes(height, width)
    ends = [np.add(level_origin(height, width, level), shape) for level, shape in enumerate(shapes)]
    rows, columns = np.max(ends, axis=0).tolist()
    return rows, columns


def _packed(name: str, weights: Floats, height: int, width: int) -> Halves:
    """Weights (t, 4 layers) for all levels in sequence, placed in the atlas."""
    atlas = np.zeros((*atlas_shape(height, width), weights.shape[1]), np.float32)
    start = 0
    for level, (rows, columns) in enumerate(level_shapes(height, width)):
        top, left = level_origin(height, width, level)
        part = weights[start : start + rows * columns].reshape(rows, columns, -1)
        atlas[top : top + rows, left : left + columns] = part
        start += rows * columns
    return layered(halves(name, atlas))
