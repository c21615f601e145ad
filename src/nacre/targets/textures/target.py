"""Targets that take encoded textures as well as reflectances."""

from __future__ import annotations

import abc
from collections.abc import Mapping

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.targets.target import TEXTURES, Target
from nacre.targets.textures.atlas import TextureAtlas
from nacre.targets.textures.filtered import FilteredTexture
from nacre.targets.textures.heights import HeightField
from nacre.targets.textures.shader_texture import ShaderTexture


class TextureTarget(Target):
    """A target for encoded textures.

    Parameters
    ----------
    heights
        For parallax.
    bytes_per_texel
        Makes a :class:`FilteredTexture` of that size; a :class:`TextureAtlas` where None.
    """

    holds = frozenset({TEXTURES})

    def __init__(
        self, heights: HeightField | None = None, bytes_per_texel: int | None = None
    ) -> None:
        self.heights, self.bytes_per_texel = heights, bytes_per_texel

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        size = self.bytes_per_texel
        if isinstance(material, Btf):
            atlas = (
                TextureAtlas.of(material, heights=self.heights)
                if size is None
                else FilteredTexture.of(material, size, heights=self.heights)
            )
            return self.texture_files(material, atlas, name)
        for given, what in ((self.heights, "height field"), (size, "bytes per texel")):
            if given is not None:
                raise NacreError(f"{material.name}: is no texture, and takes no {what}")
        return self.reflectance_files(self.reflectance(material), name)

    @abc.abstractmethod
    def reflectance_files(self, brdf: Brdf, name: str) -> Mapping[str, bytes]:
        """Files for a reflectance; see :meth:`files`."""

    @abc.abstractmethod
    def texture_files(self, texture: Btf, atlas: ShaderTexture, name: str) -> Mapping[str, bytes]:
        """Files for a texture; see :meth:`files`."""
