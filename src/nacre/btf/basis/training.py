"""Training of the default codec on textures of many materials."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf.basis.code_training import Coefficients, train_codes, turn_coefficients
from nacre.btf.basis.codec import BasisCodec
from nacre.btf.basis.function_training import train_functions
from nacre.btf.basis.functions import FunctionValues
from nacre.btf.basis.posterior import Observation
from nacre.btf.basis.recipe import BasisRecipe
from nacre.btf.basis.symmetry import symmetric_turns
from nacre.btf.texture import Btf
from nacre.channels import split_colors
from nacre.files import NacreError
from nacre.progress import Progress, silent

_BLOCK = 64
"""Texels of which coefficients are found at a time."""


def train_basis(
    textures: Sequence[Callable[[], Btf]], recipe: BasisRecipe, progress: Progress = silent
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

    Raises
    ------
    NacreError
        If there are too few texels, or directions differ.
    """
    wi, wo, texels = _gathered(textures, recipe, progress)
    orders = symmetric_turns(wi, wo)
    functions = train_functions(texels, wi, wo, orders, recipe, progress)
    del texels
    values = functions(wi, wo)
    data = _coefficients(textures, values, recipe, progress)
    turns = turn_coefficients(values, orders)
    encode, decode, prior = train_codes(data, turns, recipe, progress)
    return BasisCodec(functions, encode, decode, prior)


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
        found.append(texture.texels(_random(texture, recipe.texels, random)).astype(np.float16))
        progress("reading", index + 1, len(textures), texture.name)
    if first is None or sum(map(len, found)) < 4 * recipe.values:
        raise NacreError(f"{len(found)} textures have too few texels to learn from")
    return first.wi, first.wo, np.concatenate(found)


def _coefficients(
    textures: Sequence[Callable[[], Btf]],
    functions: FunctionValues,
    recipe: BasisRecipe,
    progress: Progress,
) -> Coefficients:
    random = np.random.default_rng(recipe.seed)
    observation = Observation(functions)
    values, residuals = [], []
    for index, open_texture in enumerate(textures):
        texture = open_texture()
        chosen = _random(texture, recipe.coded_texels, random)
        for start in range(0, len(chosen), _BLOCK):
            texels = texture.texels(chosen[start : start + _BLOCK])
            values.append(observation.moments(texels) / len(functions.mean))
            grey, chroma = split_colors(texels)
            energy = np.square(grey - functions.mean).mean(1) + np.square(chroma).mean(2).sum(0)
            left = (energy - np.square(values[-1]).sum(1)) / 3.0
            residuals.append(np.maximum(left, 0.0).astype(np.float32))
        progress("coefficients", index + 1, len(textures), texture.name)
    return Coefficients(np.concatenate(values), np.concatenate(residuals))


def _random(texture: Btf, count: int, random: np.random.Generator) -> npt.NDArray[np.intp]:
    """Distinct texels in order, `count` of them or all."""
    count = min(count, texture.texel_count)
    return np.sort(random.choice(texture.texel_count, count, replace=False))
