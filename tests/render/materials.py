"""Reflectances with known pictures."""

from __future__ import annotations

import math

from nacre.array import Array, Components
from nacre.brdf import Brdf


class White(Brdf):
    """Lambertian reflectance of albedo 1."""

    name = "white"

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`."""
        value: Array = 1.0 / math.pi + 0.0 * (wi[2] + wo[2])
        return value, value, value


class Lobe(Brdf):
    """A Blinn-Phong density of half vectors made a reflectance: under white light, seen along the
    normal, it reflects all but what falls below the horizon.

    Parameters
    ----------
    exponent
        Of the cosine of the half vector.
    """

    def __init__(self, exponent: float) -> None:
        self.exponent = exponent

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`."""
        from nacre.geometry import dot, half_vector

        h = half_vector(wi, wo)
        density = (self.exponent + 2.0) / (2.0 * math.pi) * abs(h[2]) ** self.exponent
        value = density * h[2] / (4.0 * dot(wo, h) * wi[2])
        return value, 0.5 * value, 0.0 * value
