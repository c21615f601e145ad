"""Kinds of surfaces, one module each."""

from nacre.btf.capture.families.carpet import Carpet
from nacre.btf.capture.families.fabric import Fabric
from nacre.btf.capture.families.family import Family
from nacre.btf.capture.families.felt import Felt
from nacre.btf.capture.families.leather import Leather
from nacre.btf.capture.families.stone import Stone
from nacre.btf.capture.families.wallpaper import Wallpaper
from nacre.btf.capture.families.wood import Wood

FAMILIES: dict[str, type[Family]] = {
    family.name: family for family in (Fabric, Leather, Wood, Stone, Felt, Carpet, Wallpaper)
}
"""By name."""

__all__ = ["FAMILIES", "Family"]
