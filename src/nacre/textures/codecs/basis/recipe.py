"""How the default codec is trained."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.runtime.progress import Progress
from nacre.runtime.store import Store
from nacre.textures.selection import of_same_directions

VERSION = 2  # of files of the codec, and of states of its training
_MIN_TEXELS = 2048  # that functions are found from


@dataclass(frozen=True)
class BasisRecipe:
    """Sizes and efforts; a ValueError says that a number is not positive, the seed is negative, or
    codes have more values than there are coefficients, luma_count + 2 chroma_count per texel.
    """

    code_dim: int = 32  # number of values of a code
    luma_count: int = 96  # number of functions of luma
    chroma_count: int = 16  # number of functions of chroma
    texels: int = 100
    """Of each material, that functions are found from; more where there are few materials."""
    coded_texels: int = 512  # of each material, that codes are learned from
    width: int = 192  # units of the hidden layers of the network that gives the functions
    depth: int = 4  # number of these layers
    wide: int = 512  # units of the layer after them
    hidden: int = 256  # units of each of the two layers between code and coefficients, and back
    completing: int = 512
    """Units of each of the two layers of the network that completes coefficients."""
    function_steps: int = 4000
    code_steps: int = 6000
    memory: int = 1 << 32
    """Bytes of training texels at a time: fewer of each material are taken if need be."""
    seed: int = 0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if value < (name != "seed"):
                raise ValueError(f"{name} is {value}, expected at least {int(name != 'seed')}")
        if self.code_dim > (limit := self.luma_count + 2 * self.chroma_count):
            raise ValueError(f"codes of {self.code_dim} values, of {limit} coefficients")

    @classmethod
    def of(cls, code_dim: int | None, steps: int | None, seed: int) -> BasisRecipe:
        plain = cls(seed=seed)
        limit = plain.luma_count + 2 * plain.chroma_count
        if code_dim is not None and code_dim > limit:
            raise NacreError(f"codes of kind basis have up to {limit} values, not {code_dim}")
        if steps is not None:
            fraction = plain.function_steps / (plain.function_steps + plain.code_steps)
            first = max(1, round(fraction * steps))
            plain = replace(plain, function_steps=first, code_steps=max(1, steps - first))
        return plain if code_dim is None else replace(plain, code_dim=code_dim)

    @property
    def steps(self) -> int:
        return self.function_steps + self.code_steps

    def texels_of_each(self, materials: int) -> int:
        """Texels of each material that the functions are found from, if it has so many."""
        return max(self.texels, math.ceil(_MIN_TEXELS / max(1, materials)))


class Work(NamedTuple):
    recipe: BasisRecipe
    report: Progress
    store: Store


def check_textures(textures: Sequence[Callable[[], Btf]], recipe: BasisRecipe) -> None:
    """Refuse textures with different directions, and too few texels, with a :class:`NacreError`.

    Each is opened by a call, and errors call it by its name.
    """
    each = recipe.texels_of_each(len(textures))
    opened = of_same_directions(textures, ", as all must be; leave it out")
    texels = sum(min(texture.texel_count, each) for texture in opened)
    if texels < (fewest := 4 * recipe.code_dim):
        raise NacreError(
            f"codes of {recipe.code_dim} values need at least {fewest} texels to learn from; there "
            f"are {texels} in all ({len(textures)} textures given)"
        )
