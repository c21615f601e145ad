"""Which rotations and mirrors leave a material unchanged."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.geometry import join, split, uniform_rusinkiewicz

_PAIRS = 8192
_TOLERANCE = 1e-3
"""Difference that counts as none, relative to f_r or to 1 % of its mean: far below what a table
loses, far above rounding."""


def symmetry(brdf: Brdf) -> int:
    """How often the range of azimuths that says everything fits into a full circle.

    4 if half a turn about the normal and mirroring at the x axis leave the material unchanged, 2 if
    half a turn alone does, otherwise 1. Tried on pairs of directions, half of their half vectors
    within 22.5 degrees of the normal.
    """
    if not _unchanged(brdf, lambda x, y: (-x, -y)):
        return 1
    return 4 if _unchanged(brdf, lambda x, y: (x, -y)) else 2


def unchanged_by_quarter_turn(brdf: Brdf) -> bool:
    """Whether a quarter turn, which is exact in floating point, leaves a material unchanged."""
    return _unchanged(brdf, lambda x, y: (-y, x))


def _unchanged(brdf: Brdf, move: Callable[[Floats, Floats], tuple[Floats, Floats]]) -> bool:
    """Whether f_r, and where it is known, stay when x and y of both directions move."""
    u = np.random.default_rng(0).random((4, _PAIRS))
    u[0] *= u[0]
    wi, wo = map(join, uniform_rusinkiewicz(u))
    turned = [join((*move(x, y), z)) for x, y, z in map(split, (wi, wo))]
    f_r, other = brdf.eval(wi, wo), brdf.eval(*turned)
    known = brdf.valid(wi, wo) & np.isfinite(f_r).all(axis=-1)
    other_known = brdf.valid(*turned) & np.isfinite(other).all(axis=-1)
    if np.mean(known != other_known) > _TOLERANCE:
        return False
    known &= other_known
    if not known.any():
        return True
    f_r, other = f_r[known], other[known]
    size = np.abs(f_r)
    return bool((np.abs(f_r - other) <= _TOLERANCE * np.maximum(size, 0.01 * size.mean())).all())
