"""An encoded texture in few bytes per texel, which graphics cards filter."""

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
    tiled,
)
from nacre.textures.channels import Bytes, channels
from nacre.textures.latent_map import LatentMap
from nacre.textures.lobes import latent_lobes

SIZES = range(4, 33, 4)
"""Bytes per texel that can be asked for: four in each RGBA8 texture."""
FUNCTIONS = 3
"""Layers of functions for the four numbers of a texture: luma, then both colors."""


@dataclass(frozen=True, eq=False)
class FilteredTexture(ShaderTexture):
    """The channels of a texture (:mod:`nacre.textures.channels`), and lobes for sampling.

    Parameters
    ----------
    weights
        Ordinary 8-bit textures with all their mipmaps, shape (rows, columns, 4).
    low, span
        A pixel of 0 to 1 stands for low + span times it; shape (textures, 4).
    functions
        Layers: the mean, as luma, both colors and 0; then, for each texture,
        :data:`FUNCTIONS` with one function for each channel.
    height, width, lobes, heights
        See :class:`ShaderTexture`.
    """

    height: int
    width: int
    weights: tuple[tuple[Bytes, ...], ...]
    low: Floats
    span: Floats
    functions: Halves
    lobes: Halves
    heights: HeightField | None = None

    @classmethod
    def of(
        cls,
        material: Brdf | Btf | LatentMap,
        bytes_per_texel: int,
        resolution: int = RESOLUTION,
        heights: HeightField | None = None,
    ) -> FilteredTexture:
        """An encoded texture in one of :data:`SIZES`; mipmaps come on top, a third.

        Raises NacreError if there is no such size, the texture is not encoded, its codec works for
        its own directions only, it is larger than :data:`LARGEST`, or half floats cannot hold it.
        """
        if bytes_per_texel not in SIZES:
            some = f"{', '.join(map(str, SIZES[:-1]))} or {SIZES[-1]}"
            raise NacreError(f"bytes per texel: expected {some}, got {bytes_per_texel}")
        latent = encoded(material)
        height, width = latent.shape[:2]
        if max(height, width) > LARGEST:
            raise NacreError(
                f"{latent.name}: {width} x {height} texels; the limit is {LARGEST} x {LARGEST}"
            )
        found = channels(latent, bytes_per_texel, resolution)
        nodes, count, _ = found.functions.shape
        parts = found.functions.reshape(nodes, count // 4, 4, 3).swapaxes(2, 3)
        mean = np.pad(found.mean, ((0, 0), (0, 1)))
        return cls(
            height,
            width,
            tuple(
                tuple(np.ascontiguousarray(level[..., k : k + 4]) for level in found.levels)
                for k in range(0, count, 4)
            ),
            found.low.reshape(-1, 4),
            255.0 * found.step.reshape(-1, 4),
            tiled(latent.name, np.concatenate([mean, parts.reshape(nodes, -1)], 1), resolution),
            halves(latent.name, latent_lobes(latent)),
            heights,
        )

    def weights_by_name(self) -> dict[str, tuple[Pixels, ...]]:
        return {f"weights{k}": levels for k, levels in enumerate(self.weights)}

    def roots(self, texels: Indices, functions: Floats) -> Components:
        pixels = (levels[0].reshape(-1, 4)[texels] / 255.0 for levels in self.weights)
        numbers = [
            at * span + low for at, span, low in zip(pixels, self.span, self.low, strict=True)
        ]
        parts = functions[:, 4:].reshape(len(functions), len(numbers), FUNCTIONS, 4)
        first, second, third = (
            functions[:, each] + sum(at @ parts[:, k, each].T for k, at in enumerate(numbers))
            for each in range(3)
        )
        return first, second, third
