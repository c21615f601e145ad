"""Kinds of surfaces, one module each."""

from nacre.textures.capture.generators.carpet import Carpet
from nacre.textures.capture.generators.fabric import Fabric
from nacre.textures.capture.generators.felt import Felt
from nacre.textures.capture.generators.generator import Generator
from nacre.textures.capture.generators.leather import Leather
from nacre.textures.capture.generators.stone import Stone
from nacre.textures.capture.generators.wallpaper import Wallpaper
from nacre.textures.capture.generators.wood import Wood

GENERATORS: dict[str, type[Generator]] = {
    family.name: family for family in (Fabric, Leather, Wood, Stone, Felt, Carpet, Wallpaper)
}
"""By name."""

__all__ = ["GENERATORS", "Generator"]
