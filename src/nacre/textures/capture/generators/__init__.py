"""Kinds of surfaces."""

from nacre.textures.capture.generators.fabric import Fabric
from nacre.textures.capture.generators.generator import Generator
from nacre.textures.capture.generators.natural import Leather, Stone, Wood
from nacre.textures.capture.generators.textiles import Carpet, Felt
from nacre.textures.capture.generators.wallpaper import Wallpaper

GENERATORS: dict[str, type[Generator]] = {
    family.name: family for family in (Fabric, Leather, Wood, Stone, Felt, Carpet, Wallpaper)
}
"""By name."""

__all__ = ["GENERATORS", "Generator"]
