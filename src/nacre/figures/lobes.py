"""Lobes: a reflectance in the plane of incidence, sampled densely where it is steep."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join

Mask = npt.NDArray[np.bool_]

_HORIZON = math.radians(89.9)
_STEP = math.radians(1.0)
_FINEST = math.radians(0.005)
_TOLERANCE = 0.02  # largest error of a line between two points, in the logarithm of f_r
_FAINT = 1e-6  # relative to its peak, a lobe is not followed below this


@dataclass(frozen=True)
class Lobe:
    """f_r for one direction to the light, in the plane through it and the normal.

    Parameters
    ----------
    incidence
        Polar angle of the light in radians, in [0, pi/2).
    azimuth
        Azimuth of the mirror direction in radians.
    theta
        Angles of the viewer from the normal in radians, increasing, shape (n,): positive on the
        side of the mirror direction, which is at `incidence`; the light is at -`incidence`.
    rgb
        f_r in 1/sr, linear RGB, shape (n, 3); NaN where unknown.
    """

    incidence: float
    azimuth: float
    theta: Floats
    rgb: Floats

    def intensity(self) -> Floats:
        """f_r times cos theta of the viewer in 1/sr, shape (n, 3): the flow of reflected light."""
        return np.asarray(self.rgb * np.cos(self.theta)[:, None])


def lobe(brdf: Brdf, incidence: float, azimuth: float = 0.0) -> Lobe:
    """Trace a lobe of any reflectance.

    It starts from steps of 1 degree, with finer angles around the mirror direction and the light,
    and halves steps down to 0.005 degrees where the logarithm of f_r bends, or where a measurement
    ends.

    Parameters
    ----------
    incidence
        Polar angle of the light in radians, in [0, pi/2).
    azimuth
        Of the mirror direction, in radians.

    Raises
    ------
    ValueError
        If `incidence` is out of range.
    """
    if not 0.0 <= incidence < 0.5 * math.pi:
        raise ValueError(f"incidence must lie in [0, pi/2), got {incidence}")
    wi = join(from_spherical(incidence, azimuth + math.pi))

    def values(theta: Floats) -> Floats:
        wo = join(from_spherical(theta, azimuth))
        f = np.where(brdf.valid(wi, wo)[:, None], brdf.eval(wi, wo), math.nan)
        return np.where(np.isfinite(f), f, math.nan)

    fan = np.geomspace(_FINEST, math.radians(10.0), 24)
    around = np.concatenate([-fan[::-1], [0.0], fan])
    theta = np.concatenate(
        [np.arange(-_HORIZON, _HORIZON, _STEP), [_HORIZON], incidence + around, around - incidence]
    )
    theta = np.unique(theta[np.abs(theta) <= _HORIZON])
    f = values(theta)
    while True:
        split = _bent(theta, f)
        if not split.any():
            return Lobe(incidence, azimuth, theta, f)
        middle = 0.5 * (theta[:-1] + theta[1:])[split]
        at = np.flatnonzero(split) + 1
        theta, f = np.insert(theta, at, middle), np.insert(f, at, values(middle), axis=0)


def _bent(theta: Floats, f: Floats) -> Mask:
    """Steps that must be halved, shape (n - 1,)."""
    step = np.diff(theta)
    known = np.asarray(np.isfinite(f).all(axis=1))
    long: Mask = step > 2.0 * _FINEST
    ends: Mask = known[:-1] != known[1:]
    peak = f[known].max(initial=0.0)
    if peak == 0.0:
        return ends & long
    y = np.log(np.maximum(np.where(known[:, None], f, 0.0), _FAINT * peak))
    slope = np.diff(y, axis=0) / step[:, None]
    # A straight line misses a parabola by (bend of the slope) * step / 8.
    bend = np.abs(np.diff(slope, axis=0)).max(axis=1)
    bend = np.where(known[:-2] & known[1:-1] & known[2:], bend, 0.0)
    miss = np.maximum(np.append(bend, 0.0), np.insert(bend, 0, 0.0)) * step / 8.0
    return np.asarray(((miss > _TOLERANCE) | ends) & long)
