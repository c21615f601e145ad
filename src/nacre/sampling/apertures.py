"""What an instrument with a wide source and detector measures of a reflectance.

A goniometer gives the mean of f_r over the directions of the light that its source lets through,
and over the cosine-weighted directions that its detector takes in: all light of the source falls on
the sample, and the detector sees all of what is lit. See Nicodemus et al. 1977, "Geometrical
Considerations and Nomenclature for Reflectance", section V.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, VectorList
from nacre.geometry import join, normalize, split
from nacre.numerics.direction_samples import DirectionSamples
from nacre.sampling.sequence import even_points

NODES = 128
"""Pairs of directions that a mean over two apertures is taken at: for a highlight half as wide as
the detector it is then within 2 %."""

_GOLDEN = 0.6180339887498949  # turns from one seed of a sunflower to the next: Vogel 1979
_GRAZING = 1e-4  # least cosine of a direction in an aperture, which may reach below the horizon


def half_angle(solid_angle: npt.ArrayLike) -> Floats:
    """Half the angle in radians of a round aperture with a solid angle from 0 to 2 pi sr."""
    part = np.asarray(solid_angle, np.float64) / (4.0 * math.pi)
    return np.asarray(2.0 * np.arcsin(np.sqrt(part)))


def solid_angle(half_angle: float) -> float:
    """The solid angle in sr of a round aperture, from half its angle in radians."""
    return 4.0 * math.pi * math.sin(0.5 * half_angle) ** 2


def aperture_nodes(
    samples: DirectionSamples, count: int = NODES
) -> tuple[VectorList, VectorList, Floats]:
    """Directions in the apertures of samples, and what they count for in the mean.

    Parameters
    ----------
    samples
        n samples with :attr:`~nacre.numerics.direction_samples.DirectionSamples.apertures`; without
        any, every direction is the center.
    count
        Pairs of directions for each.

    Returns
    -------
    wi, wo
        Unit directions above the horizon, shapes (n, count, 3).
    weights
        Shape (n, count), of mean 1 for each sample.
    """
    n = len(samples)
    apertures = np.zeros((n, 2)) if samples.apertures is None else samples.apertures
    # Sunflowers fill both cones; their seeds are paired in an order of its own, so that no
    # direction of the light goes with one side of the detector.
    order = np.argsort(even_points(count, 1)[:, 0])
    depth = (np.arange(count) + 0.5) / count
    turn = np.arange(count) * _GOLDEN % 1.0
    detector = np.stack([depth, turn], axis=1)
    source = detector[order]
    wi, _ = _in_cone(samples.wi, apertures[:, 0], source)
    wo, seen = _in_cone(samples.wo, apertures[:, 1], detector)
    # A source at a grazing angle also is partly below the horizon, where it lights nothing.
    weights = np.where(wi[..., 2] > _GRAZING, seen, 0.0)
    total = weights.mean(axis=1, keepdims=True)
    return wi, wo, weights / np.maximum(total, _GRAZING)


def seen_through(
    evaluate: Callable[[VectorList, VectorList], Floats], samples: DirectionSamples
) -> Floats:
    """Means over the apertures of samples of a reflectance, shape (n, channels).

    `evaluate` gives f_r (m, channels) for directions (m, 3), as :meth:`nacre.Brdf.eval` does.
    """
    if samples.apertures is None:
        return evaluate(samples.wi, samples.wo)
    wi, wo, weights = aperture_nodes(samples)
    values = evaluate(wi.reshape(-1, 3), wo.reshape(-1, 3)).reshape(*weights.shape, -1)
    return np.asarray((weights[..., None] * values).mean(axis=1))


def _in_cone(axis: VectorList, half_angle: Floats, points: Floats) -> tuple[VectorList, Floats]:
    """Directions (n, count, 3) in cones about axes (n, 3) at points (count, 2) of a square, even in
    solid angle, and their cosines from the normal, 0 below the horizon.
    """
    depth = points[:, 0] * (1.0 - np.cos(half_angle))[:, None]  # 1 - cosine from the axis
    radius = np.sqrt(depth * (2.0 - depth))
    phi = 2.0 * math.pi * points[:, 1]
    x, y, z = (part[:, None] for part in split(axis))
    # An orthonormal frame about each axis: Duff et al. 2017.
    a = -1.0 / (1.0 + z)
    b = x * y * a
    along, across = radius * np.cos(phi), radius * np.sin(phi)
    w = (
        along * (1.0 + x * x * a) + across * b + (1.0 - depth) * x,
        along * b + across * (1.0 + y * y * a) + (1.0 - depth) * y,
        -along * x - across * y + (1.0 - depth) * z,
    )
    above = np.maximum(w[2], _GRAZING)
    return join(normalize((w[0], w[1], above))), np.maximum(w[2], 0.0)
