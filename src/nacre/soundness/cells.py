"""A chi-square test in cells of the half vector, which resolve lobes however sharp."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from nacre.array import Floats
from nacre.geometry import dot, from_spherical, half_vector, join, reflect, split

_RINGS, _SECTORS = 24, 16
_FINE = 12  # points along each edge of a cell
_GOLDEN = 0.6180339887498949
_FEW = 10.0  # samples that a cell should have to count by itself


class Quadrature(NamedTuple):
    """Points of a hemisphere of lights: n cells of the half vector, each with as many points."""

    wi: Floats
    """Shape (n, points, 3)."""
    solid_angle: Floats
    """In sr, shape (n, points); 0 where `wi` lies below the horizon."""


def quadrature(wo: Floats) -> Quadrature:
    """For a view, shape (3,)."""
    rings, sectors = (np.arange(n * _FINE) for n in (_RINGS, _SECTORS))
    # Each sector has other places along the rings: an edge along one falls between all of them.
    places = rings[:, None] + (0.5 + _GOLDEN * sectors) % 1.0
    t, s = (
        x.reshape(_RINGS, _FINE, _SECTORS, _FINE).swapaxes(1, 2).reshape(-1, _FINE * _FINE)
        for x in np.broadcast_arrays(places / len(rings), (sectors + 0.5) / len(sectors))
    )
    theta = 0.5 * math.pi * t**3
    half = from_spherical(theta, (2.0 * s - 1.0) * math.pi)
    view = split(wo.astype(np.float64))
    wi = reflect(view, half)
    # dh = sin(theta) dtheta dphi, and a mirrored direction turns by 4 wo.h times that.
    steps = 1.5 * math.pi * t * t / len(rings) * 2.0 * math.pi / len(sectors)
    solid_angle = np.sin(theta) * steps * 4.0 * dot(view, half)
    seen = (wi[2] > 0.0) & (solid_angle > 0.0)
    up = np.where(seen[..., None], join(wi), (0.0, 0.0, 1.0))
    return Quadrature(up, np.where(seen, solid_angle, 0.0))


@dataclass(frozen=True)
class Cells:
    """Samples that fell into cells, and how many a density expects there.

    The last cell holds what was not drawn above the horizon.
    """

    found: Floats  # shape (n + 1,)
    expected: Floats  # shape (n + 1,)
    error: Floats  # of `expected`, from the quadrature, shape (n + 1,)
    wi: Floats  # a direction in each cell but the last, shape (n, 3)

    def scores(self) -> Floats:
        """Differences in standard deviations, shape (n + 1,)."""
        found, expected, error = self.found, self.expected, self.error
        deviation = np.sqrt(np.maximum(expected, 1.0) + error * error)
        return np.asarray((found - expected) / deviation)

    def p_value(self) -> float:
        """The chance of differences as large as these; cells with few samples count as one."""
        many = self.expected >= _FEW
        pooled = [
            np.append(x[many], x[~many].sum()) for x in (self.found, self.expected, self.error**2)
        ]
        found, expected, variance = pooled
        statistic = np.square(found - expected) / (np.maximum(expected, 1.0) + variance)
        return float(chdtrc(many.sum(), statistic.sum()))


def count_cells(
    pdf: Callable[[Floats, Floats], Floats], wo: Floats, wi: Floats, count: int
) -> Cells:
    """Compare samples with a density.

    Parameters
    ----------
    pdf
        Density in 1/sr at directions `wi` for `wo`, both of shape (n, 3).
    wo
        The view, shape (3,).
    wi
        Samples above the horizon, shape (m, 3), that are left of `count` drawn.
    """
    points = quadrature(wo)
    flat = points.wi.reshape(-1, 3)
    density = pdf(flat, np.broadcast_to(wo, flat.shape)).reshape(points.solid_angle.shape)
    mass = np.nan_to_num(density) * points.solid_angle * count
    quarters = mass.reshape(-1, _FINE // 2, 2, _FINE // 2, 2).sum(axis=(1, 3)).reshape(-1, 4)
    expected = mass.sum(axis=1)
    error = 4.0 * quarters.std(axis=1, ddof=1) / 2.0
    ring, sector = _place(half_vector(split(wi.astype(np.float64)), split(wo.astype(np.float64))))
    rows, columns = (
        np.minimum(x * n, n - 1).astype(int) for x, n in ((ring, _RINGS), (sector, _SECTORS))
    )
    cells = _RINGS * _SECTORS
    found = np.bincount(rows * _SECTORS + columns, minlength=cells).astype(float)
    found, expected = (np.append(x, count - x.sum()) for x in (found, expected))
    error = np.append(error, math.sqrt(float(np.square(error).sum())))
    return Cells(found, expected, error, points.wi[:, _FINE * _FINE // 2 + _FINE // 2])


def _place(half: tuple[Floats, ...]) -> tuple[Floats, Floats]:
    """Coordinates in [0, 1] of half vectors: the cube root of the polar angle, and the azimuth."""
    theta = np.arctan2(np.hypot(half[0], half[1]), half[2])
    return np.cbrt(theta * 2.0 / math.pi), np.arctan2(half[1], half[0]) / (2.0 * math.pi) + 0.5
