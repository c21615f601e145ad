"""Training texels as coefficients of the functions, from all directions and from some."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.measured.textures.domes import below
from nacre.measured.textures.transposition import transposed
from nacre.textures.codecs.basis.colors import split_reflectance
from nacre.textures.codecs.basis.fields import kept
from nacre.textures.codecs.basis.networks import FunctionValues
from nacre.textures.codecs.basis.recipe import Work
from nacre.textures.selection import random_texels

_BLOCK = 64  # texels that are worked on at a time
_COEFFICIENT_BYTES = 3 * 4  # of a subset: products with functions, gathered, and estimates
_FRACTIONS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.8)
_VIEWS = (38.0, 45.0, 53.0, 60.0, 68.0)
_LIGHTS = (45.0, 60.0)
_BOTH = (45.0, 53.0, 60.0, 68.0)
_FLASH = 10.0  # degrees from the view to a light that counts as being at the camera
_FLASHES = (1.0, 0.5, 0.2)  # fractions of the pairs with such a light

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TrainingTexels:
    """What is known of t texels."""

    values: Floats  # coefficients from all pairs of directions, shape (t, K)
    residuals: Floats
    """Mean squares that the functions leave out of roots of reflectance factors, (t,)."""
    subsets: Sequence[Indices]
    """Pairs of directions that an encoder may have to manage with; first all."""
    moments: Floats
    """Products of roots less the mean with the functions, over each subset, (s, t, K)."""


def partial_measurements(wi: Floats, wo: Floats, random: np.random.Generator) -> list[Indices]:
    """Subsets of pairs like those that people measure: all, random fractions of them (Unified BTF
    encoding, section 4), views, lights or both within some angle of the normal, and lights at the
    camera.
    """
    count = len(wi)
    subsets = [np.arange(count)]
    for fraction in _FRACTIONS:
        chosen = random.choice(count, max(1, int(count * fraction)), replace=False)
        subsets.append(np.sort(chosen))
    subsets += [np.flatnonzero(below(wo, degrees)) for degrees in _VIEWS]
    subsets += [np.flatnonzero(below(wi, degrees)) for degrees in _LIGHTS]
    subsets += [np.flatnonzero(below(wi, angle) & below(wo, angle)) for angle in _BOTH]
    flash = np.flatnonzero((wi * wo).sum(1) > np.cos(np.radians(_FLASH)))
    for fraction in _FLASHES:
        subsets.append(np.sort(random.permutation(flash)[: round(fraction * len(flash))]))
    return [subset for subset in subsets if len(subset)]


def training_texels(
    textures: Sequence[Callable[[], Btf]],
    functions: FunctionValues,
    rotations: Sequence[npt.NDArray[Any]],
    subsets: Sequence[Indices],
    work: Work,
) -> TrainingTexels:
    """Coefficients of random texels of every texture, each rotated about its normal at random.

    The functions are those at the textures' pairs of directions, over which they are orthonormal;
    rotations are orders of the pairs, see
    :func:`nacre.textures.codecs.symmetry.symmetric_rotations`; the first of the subsets has all
    pairs.
    """
    recipe = work.recipe
    tables = [functions.at(subset) for subset in subsets]
    coefficients = functions.luma.shape[1] + 2 * functions.chroma.shape[1]
    each = _COEFFICIENT_BYTES * len(subsets) * coefficients
    limit = max(1, recipe.memory // (each * len(textures)))

    def read(index: int) -> _Read:
        random = np.random.default_rng([recipe.seed, index])
        with transposed(textures[index]()) as texture:
            chosen = random_texels(texture, min(recipe.coded_texels, limit), random)
            orders = [rotations[k] for k in random.integers(len(rotations), size=len(chosen))]
            return _coefficients(texture, chosen, orders, functions.mean, subsets, tables)

    found: list[_Read] = []
    for index in range(len(textures)):
        found.append(kept(work.store, f"coefficients-{index}", _Read, partial(read, index)))
        work.report("coefficients", index + 1, len(textures), "")
    moments = np.concatenate([part.moments for part in found], axis=1)
    residuals = np.concatenate([part.residuals for part in found])
    return TrainingTexels(moments[0] / np.float32(len(functions.mean)), residuals, subsets, moments)


@dataclass(frozen=True, eq=False)
class _Read:
    moments: Floats
    residuals: Floats


def _coefficients(
    texture: Btf,
    chosen: Indices,
    orders: Sequence[Indices],
    mean: Floats,
    subsets: Sequence[Indices],
    tables: Sequence[FunctionValues],
) -> _Read:
    moments: list[list[Floats]] = [[] for _ in subsets]
    residuals: list[Floats] = []
    for start in range(0, len(chosen), _BLOCK):
        part = slice(start, start + _BLOCK)
        texels = texture.texels(chosen[part])
        for texel, order in zip(texels, orders[part], strict=True):
            texel[:] = texel[order]
        luma, chroma = split_reflectance(texels, mean)
        for subset, table, found in zip(subsets, tables, moments, strict=True):
            found.append(table.products(luma[:, subset], (c[:, subset] for c in chroma)))
        energy = np.square(luma).mean(1) + np.square(chroma).mean(2).sum(0)
        explained = np.square(moments[0][-1] / len(mean)).sum(1)
        residuals.append(np.maximum(energy - explained, 0.0) / 3.0)
    return _Read(np.stack([np.concatenate(m) for m in moments]), np.concatenate(residuals))
