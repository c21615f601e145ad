"""Chi-square test of a sampler in cells of the half vector, which resolve lobes however sharp."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from nacre.brdf import Brdf
from nacre.geometry import dot, from_spherical, half_vector, join, reflect, split

_RINGS, _SECTORS = 24, 16
_FINE = 12  # points along each edge of a cell
_GOLDEN = 0.6180339887498949
_FEW = 10.0  # samples that a cell should have to count by itself


class Quadrature(NamedTuple):
    """Points of a hemisphere of lights: n cells of the half vector, each with as many points."""

    wi: npt.NDArray[np.float32]
    """Shape (n, points, 3)."""
    solid_angle: npt.NDArray[np.float64]
    """In sr, shape (n, points); 0 where `wi` lies below the horizon."""


def _place(half: tuple[npt.NDArray[np.float64], ...]) -> tuple[npt.NDArray[np.float64], ...]:
    """Coordinates in [0, 1] of half vectors: the cube root of the polar angle, and the azimuth."""
    theta = np.arctan2(np.hypot(half[0], half[1]), half[2])
    return np.cbrt(theta * 2.0 / math.pi), np.arctan2(half[1], half[0]) / (2.0 * math.pi) + 0.5


def quadrature(wo: npt.NDArray[np.float32]) -> Quadrature:
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
    up = join(tuple(np.where(seen, w, z) for w, z in zip(wi, (0.0, 0.0, 1.0), strict=True)))
    return Quadrature(up.astype(np.float32), np.where(seen, solid_angle, 0.0))


def integral(brdf: Brdf, wo: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
    """Of the density of a material's samples over each cell, shape (n,)."""
    points = quadrature(wo)
    density = brdf.pdf(points.wi, wo).astype(np.float64)
    return (density * points.solid_angle).sum(axis=1)


def p_value(
    brdf: Brdf, wo: npt.NDArray[np.float32], wi: npt.NDArray[np.float32], count: int
) -> float:
    """Of samples above the horizon, shape (m, 3), that are left of `count` drawn."""
    expected = count * integral(brdf, wo)
    ring, sector = _place(half_vector(split(wi.astype(np.float64)), split(wo.astype(np.float64))))
    rows, columns = (
        np.minimum(x * n, n - 1).astype(int) for x, n in ((ring, _RINGS), (sector, _SECTORS))
    )
    found = np.bincount(rows * _SECTORS + columns, minlength=_RINGS * _SECTORS).astype(float)
    # What fell below the horizon is a cell too, and cells of few samples count as one.
    found, expected = (np.append(x, count - x.sum()) for x in (found, expected))
    many = expected >= _FEW
    found, expected = (np.append(x[many], x[~many].sum()) for x in (found, expected))
    statistic = (np.square(found - expected) / np.maximum(expected, 1.0)).sum()
    return float(chi2.sf(statistic, many.sum()))
