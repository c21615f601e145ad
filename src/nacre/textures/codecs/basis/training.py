"""Training of the default codec on textures of many materials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf, TableBtf
from nacre.errors import NacreError
from nacre.io.files import PathLike
from nacre.measured.textures.transposition import narrowed, transposed
from nacre.runtime.store import Store
from nacre.textures.codecs.basis.code_training import train_codes
from nacre.textures.codecs.basis.coefficients import (
    TrainingTexels,
    partial_measurements,
    training_texels,
)
from nacre.textures.codecs.basis.fields import kept
from nacre.textures.codecs.basis.function_training import (
    Components,
    principal_components,
    train_functions,
)
from nacre.textures.codecs.basis.networks import AngularFunctions, SkipNetwork
from nacre.textures.codecs.basis.posterior import Prior
from nacre.textures.codecs.basis.recipe import VERSION, BasisRecipe, Work, check_textures
from nacre.textures.codecs.codec import TrainingRun
from nacre.textures.codecs.symmetry import symmetric_rotations
from nacre.textures.selection import random_texels

_VALUE_BYTES = 3 * (2 + 4)
"""Of a pair of directions of a texel: as half floats, and as luma and chroma."""


def train_parts(
    run: TrainingRun, recipe: BasisRecipe
) -> tuple[AngularFunctions, SkipNetwork, SkipNetwork, SkipNetwork, Prior]:
    """The parts of the default codec, learned from textures with the same pairs of directions.

    Takes minutes. Texels count with their rotations about the normal that the directions allow, and
    with every order of the channels; uniform diffuse texels of all colors are learned with them.
    Each texture is opened three times in all, and read twice.

    Raises a FormatError if a texture cannot be read, and a NacreError if there are too few texels,
    they are too much alike or too large, directions differ, or the state belongs to another
    training.
    """
    textures = [partial(_open, run.load, path) for path in run.paths]
    check_textures(textures, recipe)
    store = Store(run.state, f"{VERSION} {recipe} {run.fingerprint}")
    work = Work(recipe, run.progress, store)

    def found_components() -> Components:
        wi, wo, texels = _gathered(textures, work)
        return principal_components(texels, wi, wo, symmetric_rotations(wi, wo), work)

    try:
        components = kept(store, "components", Components, found_components)
    except NacreError:
        store.remove()  # no more than some texels, and one may be to blame
        raise
    store.remove("texels-*")
    learn = partial(train_functions, components, work)
    functions = kept(store, "functions", AngularFunctions, learn)
    wi, wo = components.wi, components.wo
    values = functions(wi, wo)

    def found_texels() -> TrainingTexels:
        subsets = partial_measurements(wi, wo, np.random.default_rng(recipe.seed))
        rotations = symmetric_rotations(wi, wo)
        plain = partial(uniform_texels, wi, wo, recipe.coded_texels, recipe.seed)
        return training_texels([*textures, plain], values, rotations, subsets, work)

    data = kept(store, "coefficients", TrainingTexels, found_texels)
    store.remove("coefficients-*")
    return functions, *train_codes(data, values, work)


def _open(load: Callable[[PathLike], Btf], path: PathLike) -> Btf:
    """A texture with the name that its errors should have."""
    return load(path).replaced(name=str(path))


@dataclass(frozen=True, eq=False)
class _Texels:
    """Directions (n, 3), and reflectance of some texels of one texture as half floats (t, n, 3)."""

    wi: Floats
    wo: Floats
    values: npt.NDArray[np.float16]


def _gathered(textures: Sequence[Callable[[], Btf]], work: Work) -> tuple[Floats, Floats, Floats]:
    """Directions, and random texels of every texture as half floats, shape (t, n, 3)."""
    found: list[_Texels] = []
    recipe = work.recipe
    for index, open_texture in enumerate(textures):
        read = partial(_texels_of, open_texture, recipe, index, len(textures))
        found.append(kept(work.store, f"texels-{index}", _Texels, read))
        work.report("reading", index + 1, len(textures), "")
    wi, wo = found[0].wi, found[0].wo
    plain = uniform_texels(wi, wo, recipe.texels, recipe.seed).texels(slice(None))
    return wi, wo, np.concatenate([*(texels.values for texels in found), plain.astype(np.float16)])


def _texels_of(
    open_texture: Callable[[], Btf], recipe: BasisRecipe, index: int, textures: int
) -> _Texels:
    """Random texels, other ones for each place in the list."""
    random = np.random.default_rng([recipe.seed, index])
    with transposed(open_texture()) as texture:
        limit = max(1, recipe.memory // (_VALUE_BYTES * texture.pair_count * textures))
        count = min(recipe.texels_of_each(textures), limit)
        texels = texture.texels(random_texels(texture, count, random))
        return _Texels(texture.wi, texture.wo, narrowed(texels, np.float16, texture.name))


def uniform_texels(wi: Floats, wo: Floats, count: int, seed: int) -> TableBtf:
    """A row of texels, each with one reflectance factor at all pairs of directions, shape (n, 3).

    Their colors lie anywhere between black and white, dark ones as often as bright ones.
    """
    random = np.random.default_rng([seed, count])
    colors = random.random((count, 1, 3), np.float32) * random.random((count, 1, 1), np.float32)
    return TableBtf(np.broadcast_to(colors[None], (1, count, len(wi), 3)), wi, wo, "uniform")
