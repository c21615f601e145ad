"""Training of the default codec on textures of many materials."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nacre.array import Floats
from nacre.btf.basis.code_training import train_codes
from nacre.btf.basis.codec import BasisCodec
from nacre.btf.basis.coefficients import (
    TrainingTexels,
    partial_measurements,
    random_texels,
    training_texels,
)
from nacre.btf.basis.function_training import (
    Components,
    principal_components,
    train_functions,
)
from nacre.btf.basis.functions import AngularFunctions
from nacre.btf.basis.recipe import BasisRecipe
from nacre.btf.basis.stages import Stages
from nacre.btf.basis.symmetry import symmetric_turns
from nacre.btf.texture import Btf
from nacre.files import NacreError
from nacre.progress import Progress, silent


def train_basis(
    textures: Sequence[Callable[[], Btf]],
    recipe: BasisRecipe,
    progress: Progress = silent,
    stages: Stages | None = None,
) -> BasisCodec:
    """The default codec, learned from textures of the same pairs of directions.

    Takes minutes. Texels count with their turns about the normal that the directions allow, and
    with every order of the channels.

    Parameters
    ----------
    textures
        Each gives a texture when called, twice in all.
    recipe
        Sizes and efforts.
    progress
        Called as it goes on.
    stages
        Where results are kept, from which a later call goes on.

    Raises
    ------
    NacreError
        If there are too few texels, or directions differ.
    """
    kept = stages or Stages()

    def found_components() -> Components:
        wi, wo, texels = _gathered(textures, recipe, progress)
        return principal_components(texels, wi, wo, symmetric_turns(wi, wo), recipe, progress)

    components = kept.result("components", Components, found_components)
    functions = kept.result(
        "functions", AngularFunctions, lambda: train_functions(components, recipe, progress, kept)
    )
    wi, wo = components.wi, components.wo
    values = functions(wi, wo)

    def found_texels() -> TrainingTexels:
        random = np.random.default_rng(recipe.seed)
        subsets = partial_measurements(wi, wo, random)
        orders, count = symmetric_turns(wi, wo), recipe.coded_texels
        return training_texels(textures, values, orders, subsets, count, random, progress)

    data = kept.result("coefficients", TrainingTexels, found_texels)
    return BasisCodec(functions, *train_codes(data, values, recipe, progress, kept))


def _gathered(
    textures: Sequence[Callable[[], Btf]], recipe: BasisRecipe, progress: Progress
) -> tuple[Floats, Floats, Floats]:
    """Directions, and random texels of every texture as half floats, shape (t, n, 3)."""
    random = np.random.default_rng(recipe.seed)
    found: list[Floats] = []
    first: Btf | None = None
    for index, open_texture in enumerate(textures):
        texture = open_texture()
        first = first or texture
        if texture.wi.shape != first.wi.shape or not (
            np.allclose(texture.wi, first.wi, atol=1e-3)
            and np.allclose(texture.wo, first.wo, atol=1e-3)
        ):
            raise NacreError(f"{texture.name}: is not measured at the directions of {first.name}")
        found.append(
            texture.texels(random_texels(texture, recipe.texels, random)).astype(np.float16)
        )
        progress("reading", index + 1, len(textures), texture.name)
    if first is None or sum(map(len, found)) < 4 * recipe.values:
        raise NacreError(f"{len(found)} textures have too few texels to learn from")
    return first.wi, first.wo, np.concatenate(found)
