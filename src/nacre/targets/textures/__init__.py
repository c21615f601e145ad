"""Encoded textures as half-float texture arrays, and as code that decodes them."""

from nacre.targets.textures.atlas import TextureAtlas
from nacre.targets.textures.heights import HeightField

__all__ = ["HeightField", "TextureAtlas"]
