"""Training texels as coefficients of the functions, from all directions and from some."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf.basis.functions import FunctionValues
from nacre.btf.domes import below
from nacre.btf.texture import Btf
from nacre.channels import split_colors
from nacre.progress import Progress

_BLOCK = 64
"""Texels that are worked on at a time."""
_SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.8)
_VIEWS = (38.0, 45.0, 53.0, 60.0, 68.0)
_LIGHTS = (45.0, 60.0)
_BOTH = (45.0, 53.0, 60.0, 68.0)

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TrainingTexels:
    """What is known of texels.

    Parameters
    ----------
    values
        Coefficients from all pairs of directions, shape (t, K).
    residuals
        Mean square of what the functions leave of reflectance factors, shape (t,).
    subsets
        Pairs of directions that an encoder may have to do with; the first has all.
    moments
        Products of reflectance less the mean with the functions over each of the subsets, shape
        (s, t, K).
    """

    values: Floats
    residuals: Floats
    subsets: Sequence[Indices]
    moments: Floats


def partial_measurements(wi: Floats, wo: Floats, random: np.random.Generator) -> list[Indices]:
    """Subsets of pairs like those that people measure: all, random shares of them (Unified BTF
    encoding, section 4), and views, lights or both within some angle of the normal.
    """
    count = len(wi)
    subsets = [np.arange(count)]
    for share in _SHARES:
        chosen = random.choice(count, max(1, int(count * share)), replace=False)
        subsets.append(np.sort(chosen))
    subsets += [np.flatnonzero(below(wo, degrees)) for degrees in _VIEWS]
    subsets += [np.flatnonzero(below(wi, degrees)) for degrees in _LIGHTS]
    subsets += [np.flatnonzero(below(wi, angle) & below(wo, angle)) for angle in _BOTH]
    return [subset for subset in subsets if len(subset)]


def training_texels(
    textures: Sequence[Callable[[], Btf]],
    functions: FunctionValues,
    turns: Sequence[npt.NDArray[Any]],
    subsets: Sequence[Indices],
    per_texture: int,
    random: np.random.Generator,
    progress: Progress,
) -> TrainingTexels:
    """Coefficients of random texels of every texture, each turned about its normal at random.

    Parameters
    ----------
    textures
        Each gives a texture when called.
    functions
        At its pairs of directions, over which they are orthonormal.
    turns
        Orders of the pairs, see :func:`nacre.btf.basis.symmetry.symmetric_turns`.
    subsets
        Of the pairs, the first of all.
    per_texture
        Texels of each.
    random
        Picks texels and turns.
    progress
        Called as it goes on.
    """
    tables = [(functions.grey[s], functions.chroma[s]) for s in subsets]
    moments: list[list[Floats]] = [[] for _ in subsets]
    residuals: list[Floats] = []
    for index, open_texture in enumerate(textures):
        texture = open_texture()
        chosen = random_texels(texture, per_texture, random)
        for start in range(0, len(chosen), _BLOCK):
            texels = texture.texels(chosen[start : start + _BLOCK])
            for texel in texels:
                texel[:] = texel[turns[int(random.integers(len(turns)))]]
            grey, chroma = split_colors(texels)
            grey -= functions.mean
            for subset, (greys, chromas), found in zip(subsets, tables, moments, strict=True):
                parts = [grey[:, subset] @ greys, *(c[:, subset] @ chromas for c in chroma)]
                found.append(np.concatenate(parts, axis=1))
            energy = np.square(grey).mean(1) + np.square(chroma).mean(2).sum(0)
            explained = np.square(moments[0][-1] / len(functions.mean)).sum(1)
            residuals.append(np.maximum(energy - explained, 0.0) / 3.0)
        progress("coefficients", index + 1, len(textures), texture.name)
    stacked = np.stack([np.concatenate(found) for found in moments])
    values = stacked[0] / np.float32(len(functions.mean))
    return TrainingTexels(values, np.concatenate(residuals), subsets, stacked)


def random_texels(texture: Btf, count: int, random: np.random.Generator) -> Indices:
    """Distinct texels in order, `count` of them or all."""
    count = min(count, texture.texel_count)
    return np.sort(random.choice(texture.texel_count, count, replace=False))
