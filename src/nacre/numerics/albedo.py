"""Directional albedo of whatever can be evaluated and sampled."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import cosine_hemisphere, join
from nacre.numerics.exchange import numbers

USUAL_ALBEDO = 1.2
"""Largest albedo that counts as usual for a measurement: the largest seen is 1.156."""

_POINTS = 1 << 13
_STEPS = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
"""Steps of the R sequence in three dimensions; see :mod:`nacre.sampling.sequence`."""


class Reflecting(Protocol):
    """What an albedo needs: the methods of :class:`nacre.Brdf`."""

    def eval(self, wi: Any, wo: Any) -> Any: ...
    def sample(self, wo: Any, u: Any) -> Any: ...
    def pdf(self, wi: Any, wo: Any) -> Any: ...


def directional_albedo(brdf: Reflecting, wo: npt.ArrayLike) -> Floats:
    """The integral of f_r cos(theta_i) over all `wi`, linear RGB, for `wo` of shape (..., 3).

    Half of the fixed points are drawn by the reflectance's sampler, half by the cosine, with the
    balance heuristic.
    """
    views = numbers(wo)
    u = ((0.5 + np.arange(1.0, _POINTS + 1.0)[:, None] * _STEPS) % 1.0).astype(np.float32)
    around = join(cosine_hemisphere(u[:, 1], u[:, 2]))
    found = np.empty((math.prod(views.shape[:-1]), 3), views.dtype)
    for index, view in enumerate(views.reshape(-1, 3)):
        wi = np.concatenate([brdf.sample(np.broadcast_to(view, u.shape), u)[0], around])
        density = 0.5 * (brdf.pdf(wi, view) + np.maximum(wi[:, 2], 0.0) / math.pi)
        weight = np.divide(wi[:, 2], density, out=np.zeros_like(density), where=density > 0.0)
        found[index] = (brdf.eval(wi, view) * weight[:, None]).mean(axis=0, dtype=np.float64)
    return found.reshape(views.shape)
