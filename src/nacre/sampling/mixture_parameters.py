"""Parameters of a :class:`GgxMixture` that may have any value, for fits and for networks.

They are a matrix, a row for each cosine of the view: logarithms of the fractions of the uniform,
the squared and the GGX lobes relative to that of the cosine lobe; roughnesses along and across, and
shifts, of all lobes, through functions that keep them within bounds.
"""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Array, Floats, namespace
from nacre.sampling.mixture import GgxLobe, GgxMixture, Values

MIN_COSINE = 0.01  # fraction of the cosine lobe: it bounds every weight
MAX_FITTED_SHIFT = 1.0
ROUGHNESSES = 0.004, 1.5  # range of roughnesses
_LOW, _HIGH = (math.log(a) for a in ROUGHNESSES)
_FARTHEST = 30.0  # free parameters beyond this, either way, mean the same: exponentials stay finite


def columns(lobes: int) -> tuple[slice, slice, slice]:
    fractions, roughnesses = 2 + lobes, 2 + 3 * lobes
    return slice(0, fractions), slice(fractions, roughnesses), slice(roughnesses, 2 + 4 * lobes)


def bounded(rows: Array, lobes: int) -> tuple[Array, Array, Array]:
    """Fractions, roughnesses and shifts from rows of free parameters, shape (..., 2 + 4 lobes)."""
    fractions, roughnesses, shifts = (rows[..., part] for part in columns(lobes))
    powers = namespace(rows).exp(_clipped(fractions))
    return (
        (1.0 - MIN_COSINE) * powers / (1.0 + powers.sum(-1)[..., None]),
        bounded_roughness(roughnesses),
        MAX_FITTED_SHIFT * (2.0 * logistic(2.0 * shifts) - 1.0),
    )


def bounded_roughness(free: Array) -> Array:
    return namespace(free).exp(_LOW + (_HIGH - _LOW) * logistic(free))


def free_roughness(roughness: float) -> float:
    """The inverse of :func:`bounded_roughness`."""
    place = (math.log(roughness) - _LOW) / (_HIGH - _LOW)
    return math.log(place / (1.0 - place))


def logistic(free: Array) -> Array:
    """1 / (1 + exp(-x)), in (0, 1)."""
    return 1.0 / (1.0 + namespace(free).exp(-1.0 * _clipped(free)))


def rounded_mixture(
    rows: Floats, cosines: Values, lobes: int, angle: float | None = None
) -> GgxMixture:
    """The sampler for free parameters (m, 2 + 4 lobes), with four digits of each."""
    fractions, roughnesses, shifts = bounded(rows, lobes)
    values = np.concatenate([fractions.round(4), roughnesses, shifts], axis=1)
    uniform, squared, *rest = (tuple(float(f"{x:.4g}") for x in row) for row in values.T)
    found = (GgxLobe(*rest[k::lobes]) for k in range(lobes))
    return GgxMixture(tuple(found), uniform, squared, cosines, angle)


def _clipped(free: Array) -> Array:
    xp = namespace(free)
    return xp.minimum(xp.maximum(free, -_FARTHEST), _FARTHEST)
