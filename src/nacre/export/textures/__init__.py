"""Encoded textures as half-float texture arrays, and as code that decodes them."""

from nacre.export.textures.atlas import TextureAtlas
from nacre.export.textures.heights import HeightField

__all__ = ["HeightField", "TextureAtlas"]
