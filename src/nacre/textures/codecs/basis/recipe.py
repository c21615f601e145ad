"""How the default codec is trained."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.measured.textures.directions import same_pairs

_LEAST_TEXELS = 2048
"""From which functions are found."""


@dataclass(frozen=True)
class BasisRecipe:
    """Sizes and efforts.

    Parameters
    ----------
    values
        Of a code.
    grays, chromas
        Functions of gray values, and of pairs of colors: grays + 2 chromas coefficients a texel.
    texels
        Of each material, from which the functions are found; more where there are few materials.
    coded_texels
        Of each material, from which codes are learned.
    width, depth, wide
        Units of the hidden layers of the network that gives the functions, their number, and units
        of the layer after them.
    hidden
        Units of each of the two layers between code and coefficients, and back.
    completing
        Units of each of the two layers of the network that completes coefficients.
    function_steps, code_steps
        Of the optimizer.
    memory
        Bytes of training texels at a time: fewer of each material are taken if need be.
    seed
        Of all that is random.

    Raises
    ------
    ValueError
        If a number is not positive, the seed is negative, or there are more values than
        coefficients.
    """

    values: int = 32
    greys: int = 96
    chromas: int = 16
    texels: int = 100
    coded_texels: int = 512
    width: int = 192
    depth: int = 4
    wide: int = 512
    hidden: int = 256
    completing: int = 512
    function_steps: int = 4000
    code_steps: int = 6000
    memory: int = 1 << 32
    seed: int = 0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if value < (name != "seed"):
                raise ValueError(f"{name} is {value}, expected at least {int(name != 'seed')}")
        if self.values > (most := self.greys + 2 * self.chromas):
            raise ValueError(f"{self.values} values, of {most} coefficients")

    def texels_of_each(self, materials: int) -> int:
        """Texels of each material from which the functions are found, if there are so many."""
        return max(self.texels, math.ceil(_LEAST_TEXELS / max(1, materials)))


def check_textures(textures: Sequence[Callable[[], Btf]], recipe: BasisRecipe) -> None:
    """Refuse textures of different directions, and too few texels.

    Parameters
    ----------
    textures
        Each gives a texture when called; errors call it by its name.
    recipe
        What is to be learned from them.

    Raises
    ------
    FormatError
        If one cannot be opened.
    NacreError
        If they will not do.
    """
    first: Btf | None = None
    texels, each = 0, recipe.texels_of_each(len(textures))
    for open_texture in textures:
        texture = open_texture()
        first = first or texture
        if not same_pairs(texture.wi, texture.wo, first.wi, first.wo):
            raise NacreError(
                f"{texture.name}: is not measured at the directions of {first.name}, as all must "
                "be; leave it out"
            )
        texels += min(texture.texel_count, each)
    if texels < (least := 4 * recipe.values):
        raise NacreError(
            f"{recipe.values} values a code are learned from {least} texels at least; there are "
            f"{texels} in all ({len(textures)} given)"
        )
