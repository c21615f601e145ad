"""Directions at which tables of other tools hold f_r: dense where the light is mirrored.

Nodes lie at distances from the mirror direction that grow with the square of their number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import primaries
from nacre.geometry import from_spherical, join
from nacre.spectra import rgb_weights

_STEEPEST = 85.0
_HORIZON = math.radians(89.9)
_BAND_LIMIT = 40
ROTATIONS = np.arange(0.0, 361.0, 30.0)  # degrees, of an anisotropic sample under its light
BANDS = np.arange(400.0, 701.0, 20.0)  # wavelengths in nm of the spectra that colors become


@dataclass(frozen=True)
class Resolution:
    """Nodes of a table that is written; a ValueError says that a number is out of range."""

    incidences: int = 18  # polar angles of the light, even from 0 to 85 degrees; 2 to 90
    polars: int = 40  # polar angles of the viewer, or distances from the mirror direction; 4 to 180
    azimuths: int = 19  # from 0 to 180 degrees; 3 to 180

    def __post_init__(self) -> None:
        given = (self.incidences, self.polars, self.azimuths)
        for number, low, high in zip(given, (2, 4, 3), (90, 180, 180), strict=True):
            if not low <= number <= high:
                raise ValueError("incidences are 2 to 90, polars 4 to 180, azimuths 3 to 180")

    def lights(self) -> Floats:
        return np.linspace(0.0, _STEEPEST, self.incidences)

    def views(self, light: float) -> tuple[Floats, Floats]:
        """Polar angles and azimuths in degrees, from 0 to 360 from the mirror direction, for a
        light.
        """
        half = growing(180.0, self.azimuths)
        azimuths = np.concatenate([half, 360.0 - half[-2::-1]])
        roots = math.sqrt(light), math.sqrt(90.0 - light)
        below = round((self.polars - 1) * roots[0] / sum(roots))
        down = light - growing(light, below + 1)[:0:-1]
        up = light + growing(90.0 - light, self.polars - below)
        return np.concatenate([down, up]), azimuths


def growing(span: float, count: int) -> Floats:
    """Nodes from 0 to a span at distances that grow."""
    return span * (np.arange(count) / max(count - 1, 1)) ** 2


def directions(light: float, polars: Floats, azimuths: Floats) -> tuple[Floats, Floats]:
    """Light and views, shapes (3,) and (polars, azimuths, 3), from angles in degrees.

    The light lies at azimuth 180 degrees, so that 0 is that of the mirror direction. Angles at the
    horizon are taken a tenth of a degree above it.
    """
    wi = join(from_spherical(*np.radians([light, 180.0])))
    theta = np.minimum(np.radians(polars), _HORIZON)[:, None]
    wo = join(from_spherical(theta, np.radians(azimuths)))
    return wi, wo


def bands(brdf: Brdf) -> Floats:
    """Wavelengths in nm, shape (bands,): those of a reflectance, up to 40, else :data:`BANDS`."""
    own = brdf.wavelengths
    return BANDS if own is None or len(own) > _BAND_LIMIT else np.asarray(own, np.float64)


def spectra(brdf: Brdf, wi: Floats, wo: Floats) -> Floats:
    """f_r in 1/sr at :func:`bands`, shape (..., bands); upsampled for a reflectance in RGB.

    The upsampled spectra have the same color, unless it is so saturated that they would be negative
    somewhere.
    """
    wi, wo = np.broadcast_arrays(wi, wo)
    wanted = bands(brdf)
    if brdf.wavelengths is None:
        basis = np.stack(primaries(wanted), axis=1)
        exact = basis @ np.linalg.inv(basis.T @ rgb_weights(wanted)).T
        return np.asarray(np.maximum(brdf.eval(wi, wo) @ exact.T, 0.0))
    values = brdf.eval_spectral(wi, wo)
    own = np.asarray(brdf.wavelengths, np.float64)
    if len(own) == len(wanted):
        return values
    low = np.clip(np.searchsorted(own, wanted) - 1, 0, len(own) - 2)
    part = np.clip((wanted - own[low]) / (own[low + 1] - own[low]), 0.0, 1.0)
    return np.asarray(values[..., low] * (1.0 - part) + values[..., low + 1] * part)


def reflected(values: Floats, polars: Floats, azimuths: Floats) -> Floats:
    """Fraction of the light that a table reflects, by the trapezoidal rule: the integral of f_r cos
    theta, shape (...).

    Values are f_r in 1/sr, shape (polars, azimuths, ...), at nodes in degrees.
    """
    theta, phi = np.radians(polars), np.radians(azimuths)
    half = 2.0 if 0.0 < azimuths[-1] <= 180.1 else 1.0  # both sides of the plane of incidence
    around = (
        half * np.trapezoid(values, phi, axis=1) if len(phi) > 1 else 2.0 * np.pi * values[:, 0]
    )
    weight = (np.sin(theta) * np.cos(theta)).reshape(-1, *[1] * (around.ndim - 1))
    return np.asarray(np.trapezoid(around * weight, theta, axis=0))


def scaled_note(factors: Floats, to: str, tool: str) -> list[str]:
    """What to say about factors that tables were multiplied by; nothing if all are 1 to 1 %."""
    low, high = float(np.min(factors)), float(np.max(factors))
    if low >= 0.99 and high <= 1.01:
        return []
    by = f"{low:.3g}" if high <= 1.01 * low else f"{low:.3g} to {high:.3g}"
    keep = "--as-stored keeps the values as they are"
    return [f"Tables are multiplied by {by} to match {to}, as {tool} does; {keep}."]
