"""What shaders read of an encoded texture: its textures, whose pixels are half floats or bytes."""

from __future__ import annotations

import abc
import math

import numpy as np
import numpy.typing as npt

from nacre.array import Components, Floats
from nacre.brdf import Brdf
from nacre.btf import Btf, Indices
from nacre.errors import NacreError
from nacre.io.ktx2 import Pixels, ktx2
from nacre.io.tensors import HALF_LARGEST
from nacre.targets.textures.heights import HeightField
from nacre.textures.latent_map import LatentMap
from nacre.textures.mipmap import level_shapes

Halves = npt.NDArray[np.float16]

RESOLUTION = 16
"""Nodes along each axis of the grid of directions."""
LARGEST = 4096
"""Pixels along an edge of an array that nearly all graphics cards support."""


class ShaderTexture(abc.ABC):
    """An encoded texture of `height` x `width` texels as textures for shaders.

    Attributes
    ----------
    functions
        At the nodes of the grid of directions, shape (layers, R^2, R^2, 4). Row ly R + vy and
        column lx R + vx hold light (lx, ly) with view (vx, vy).
    lobes
        For sampling, of every k-th texel, shape (rows, columns, 4).
    heights
        For parallax.
    """

    height: int
    width: int
    functions: Halves
    lobes: Halves
    heights: HeightField | None

    @property
    def resolution(self) -> int:
        """Resolution of the grid of directions."""
        return math.isqrt(self.functions.shape[1])

    @property
    def levels(self) -> int:
        """The number of levels from the map to a single texel."""
        return len(level_shapes(self.height, self.width))

    def function_rows(self) -> Halves:
        """Functions at nodes, shape (nodes, numbers); views vary fastest."""
        size = self.resolution
        grid = self.functions.transpose(1, 2, 0, 3).reshape(size, size, size, size, -1)
        return np.ascontiguousarray(grid.swapaxes(1, 2).reshape(size**4, -1))

    @abc.abstractmethod
    def weights_by_name(self) -> dict[str, tuple[Pixels, ...]]:
        """Textures with what belongs to texels: their levels, by the ends of their names."""

    @abc.abstractmethod
    def roots(self, texels: Indices, functions: Floats) -> Components:
        """Luma and the pair of colors of some texels, shape (t, n) each.

        Functions, shape (n, numbers), are :meth:`function_rows` at pairs of directions.
        """

    def textures(self) -> dict[str, tuple[Pixels, ...]]:
        """All textures as their levels, by the ends of their names."""
        found = {**self.weights_by_name(), "functions": (self.functions,), "lobes": (self.lobes,)}
        return found if self.heights is None else found | {"heights": (self.heights.pixels,)}

    def files(self, name: str) -> dict[str, bytes]:
        """All textures as KTX 2.0 files."""
        return {f"{name}_{each}.ktx2": ktx2(*levels) for each, levels in self.textures().items()}


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


def tiled(name: str, functions: Floats, resolution: int) -> Halves:
    """Functions (nodes, 4 layers) as one tile of views for each light."""
    grid = halves(name, functions).reshape(*(resolution,) * 4, -1)
    return layered(grid.swapaxes(1, 2).reshape(resolution**2, resolution**2, -1))


def layered(values: Halves) -> Halves:
    """Values (rows, columns, n) as pictures with four numbers, shape (layers, rows, columns, 4)."""
    rows, columns, count = values.shape
    return np.ascontiguousarray(values.reshape(rows, columns, count // 4, 4).transpose(2, 0, 1, 3))


def halves(name: str, values: Floats) -> Halves:
    """Values as half floats; a NacreError if they are too large."""
    if not float(np.abs(values).max()) < HALF_LARGEST:
        raise NacreError(f"{name}: half floats cannot hold its numbers")
    return values.astype(np.float16)
