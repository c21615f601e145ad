"""Whether textures will do to learn the default codec from, before any of their values are read."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.measured.textures.directions import same_pairs
from nacre.textures.codecs.basis.recipe import BasisRecipe


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
