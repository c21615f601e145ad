"""Whether a reflectance is isotropic if it says so."""

from __future__ import annotations

import math

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.geometry import join, rotate, split, uniform_rusinkiewicz

_PAIRS = 512
_TOLERANCE = 0.02
"""Difference that counts as none, relative to f_r or to 1 % of its mean: float32 leaves less even
for sharp highlights."""
_FRACTION = 0.01  # fraction of the pairs that may differ by more: tables jump between nodes


def check_isotropic(brdf: Brdf) -> None:
    """Refuse a reflectance that says it is isotropic and is not.

    f_r is compared at 512 pairs of directions, the same for all materials, and at these rotated
    about the normal, each by its own angle. Classes whose isotropy is known
    (:attr:`nacre.Brdf.isotropy_known`) and scattered samples are taken at their word.

    Raises NacreError if more than 1 % of the pairs differ by more than 2 %.
    """
    if not brdf.isotropic or brdf.isotropy_known or brdf.scattered() is not None:
        return
    u = np.random.default_rng(0).random((5, _PAIRS))
    u[0] *= u[0]  # near mirror directions, where highlights are
    pairs = uniform_rusinkiewicz(u[:4])
    above = (pairs[0][2] > 0.0) & (pairs[1][2] > 0.0)
    wi, wo = (join(w)[above] for w in pairs)
    angle = 2.0 * math.pi * u[4, above]
    rotated = [join(rotate(split(w), angle)) for w in (wi, wo)]
    one, other = brdf.eval(wi, wo), brdf.eval(*rotated)
    known = brdf.valid(wi, wo) & brdf.valid(*rotated)
    known &= np.isfinite(one).all(axis=-1) & np.isfinite(other).all(axis=-1)
    if not known.any():
        return
    one, other = one[known].astype(np.float64), other[known].astype(np.float64)
    size = np.maximum(one, other)
    difference = np.abs(one - other) / np.maximum(np.maximum(size, 0.01 * size.mean()), 1e-30)
    differing = (difference > _TOLERANCE).any(axis=-1)
    if differing.mean() > _FRACTION:
        raise NacreError(
            f"{brdf.name or type(brdf).__name__}: says that it is isotropic, but f_r differs by up "
            f"to {difference.max():.0%} where both directions are rotated about the normal "
            f"(at {differing.sum()} of {len(differing)} pairs): set isotropic = False"
        )
