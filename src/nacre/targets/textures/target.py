"""Targets that take encoded textures as well as reflectances."""

from __future__ import annotations

import abc
from collections.abc import Mapping

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.targets.target import TEXTURES, Target
from nacre.targets.textures.atlas import TextureAtlas
from nacre.targets.textures.heights import HeightField


class TextureTarget(Target):
    """A target for encoded textures, as a :class:`TextureAtlas`; `heights` are for parallax."""

    holds = frozenset({TEXTURES})

    def __init__(self, heights: HeightField | None = None) -> None:
        self.heights = heights

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        if isinstance(material, Btf):
            atlas = TextureAtlas.of(material, heights=self.heights)
            return self.texture_files(material, atlas, name)
        if self.heights is not None:
            raise NacreError(f"{material.name}: is no texture, and takes no height field")
        return self.reflectance_files(self.reflectance(material), name)

    @abc.abstractmethod
    def reflectance_files(self, brdf: Brdf, name: str) -> Mapping[str, bytes]:
        """Files for a reflectance; see :meth:`files`."""

    @abc.abstractmethod
    def texture_files(self, texture: Btf, atlas: TextureAtlas, name: str) -> Mapping[str, bytes]:
        """Files for a texture; see :meth:`files`."""
