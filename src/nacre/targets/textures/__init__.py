"""Encoded textures as textures that shaders read, and as code that decodes them."""

from nacre.targets.textures.atlas import TextureAtlas
from nacre.targets.textures.filtered import FilteredTexture
from nacre.targets.textures.heights import HeightField

__all__ = ["FilteredTexture", "HeightField", "TextureAtlas"]
