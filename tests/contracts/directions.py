"""Pairs of directions that all materials and samplers are asked for."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

from nacre.testing.extremes import extreme_directions, extreme_numbers, views
from tests.measured.support import hemisphere

__all__ = ["awkward_pairs", "extreme_directions", "extreme_numbers", "pairs", "views"]

Vectors = npt.NDArray[np.float32]


@functools.cache
def pairs(count: int = 4000) -> tuple[Vectors, Vectors]:
    """Random directions above the horizon."""
    random = np.random.default_rng(7)
    return hemisphere(random, count), hemisphere(random, count)


@functools.cache
def awkward_pairs() -> tuple[Vectors, Vectors]:
    """Random pairs, and such at the horizon, at the pole, of equal and of mirrored directions."""
    wi, wo = (w.copy() for w in pairs(2000))
    wi[:200] = wo[:200]
    wi[200:400] = wo[200:400] * np.float32([-1, -1, 1])
    wi[400:500] = wo[500:600] = (0.0, 0.0, 1.0)
    for w in (wi[600:900], wo[800:1100]):
        w[:, 2] *= 1e-3
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    wi[1100:1200, 2] *= -1.0
    return wi, wo
