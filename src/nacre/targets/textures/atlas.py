"""An encoded texture as arrays of half floats for shaders."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.io.ktx2 import ktx2
from nacre.io.tensors import HALF_LARGEST
from nacre.targets.textures.heights import HeightField
from nacre.textures.factors import CHROMAS, LUMAS, factor
from nacre.textures.latent_map import LatentMap
from nacre.textures.lobes import latent_lobes
from nacre.textures.mipmap import level_shapes

Halves = npt.NDArray[np.float16]

RESOLUTION = 16
"""Nodes along each axis of the grid of directions; functions then take 15 MB."""
LARGEST = 4096
"""Pixels along an edge of an array that nearly all graphics cards support."""
LUMA_LAYERS, CHROMA_LAYERS = LUMAS // 4, CHROMAS // 4
"""Layers of functions, four functions in each."""


@dataclass(frozen=True, eq=False)
class TextureAtlas:
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
        At the nodes of the grid of directions, shape (layers, R^2, R^2, 4): luma, then chroma. Row
        ly R + vy and column lx R + vx hold light (lx, ly) with view (vx, vy).
    lobes
        For every k-th texel, shape (rows, columns, 4).
    heights
        For parallax.
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
        height, width = latent.codes.shape[:2]
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
            _tiled(latent.name, factors.functions, resolution),
            _halves(latent.name, latent_lobes(latent)),
            heights,
        )

    @property
    def resolution(self) -> int:
        """Resolution of the grid of directions."""
        return math.isqrt(self.functions.shape[1])

    @property
    def levels(self) -> int:
        """The number of levels from the map to a single texel."""
        return len(level_shapes(self.height, self.width))

    def level_weights(self) -> list[Halves]:
        """Weights of each level, shape (rows, columns, numbers)."""
        pixels = self.weights.transpose(1, 2, 0, 3).reshape(*self.weights.shape[1:3], -1)
        found = []
        for level, (rows, columns) in enumerate(level_shapes(self.height, self.width)):
            top, left = level_origin(self.height, self.width, level)
            found.append(pixels[top : top + rows, left : left + columns])
        return found

    def function_rows(self) -> Halves:
        """Functions at nodes, shape (nodes, numbers); views vary fastest."""
        size = self.resolution
        grid = self.functions.transpose(1, 2, 0, 3).reshape(size, size, size, size, -1)
        return np.ascontiguousarray(grid.swapaxes(1, 2).reshape(size**4, -1))

    def textures(self) -> dict[str, Halves]:
        """All arrays, by the ends of their names."""
        found = {"weights": self.weights, "functions": self.functions, "lobes": self.lobes}
        return found if self.heights is None else found | {"heights": self.heights.pixels}

    def files(self, name: str) -> dict[str, bytes]:
        """All arrays as KTX 2.0 files."""
        return {f"{name}_{each}.ktx2": ktx2(pixels) for each, pixels in self.textures().items()}


def encoded(material: Brdf | Btf | LatentMap) -> LatentMap:
    """The codes of a texture that decodes at any directions; NacreError if there are none."""
    name = material.name or "this material"
    latent = material if isinstance(material, LatentMap) else getattr(material, "latent", None)
    if not isinstance(latent, LatentMap):
        raise NacreError(f"{name}: is not encoded; nacre fit encodes a texture")
    if not latent.codec.any_directions:
        raise NacreError(
            f"{name}: its codec ({latent.codec.kind}) knows its own directions only; encode the "
            "texture with the default codec"
        )
    return latent


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
    return _layers(_halves(name, atlas))


def _tiled(name: str, functions: Floats, resolution: int) -> Halves:
    """Functions (nodes, 4 layers) as one tile of views for each light."""
    grid = _halves(name, functions).reshape(*(resolution,) * 4, -1)
    return _layers(grid.swapaxes(1, 2).reshape(resolution**2, resolution**2, -1))


def _layers(values: Halves) -> Halves:
    """Values (rows, columns, n) as pictures with four numbers, shape (layers, rows, columns, 4)."""
    rows, columns, count = values.shape
    return np.ascontiguousarray(values.reshape(rows, columns, count // 4, 4).transpose(2, 0, 1, 3))


def _halves(name: str, values: Floats) -> Halves:
    if not float(np.abs(values).max()) < HALF_LARGEST:
        raise NacreError(f"{name}: half floats cannot hold its numbers")
    return values.astype(np.float16)
