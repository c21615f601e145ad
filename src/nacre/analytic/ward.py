"""Ward's Gaussian lobe, and Duer's normalization of it."""

from __future__ import annotations

import math

from nacre.analytic.model import DIFFUSE, SCALE, AnalyticBrdf, Parameter, Values, coated
from nacre.array import Array, Components, namespace
from nacre.geometry import half_vector

ROUGHNESS = Parameter("roughness", 1e-3, 5.0, (0.02, 0.6))


def gaussian(h: Components, roughness: Array) -> Array:
    """exp(-tan(theta_h)^2 / roughness^2)."""
    xp = namespace(*h)
    tan2 = (h[0] * h[0] + h[1] * h[1]) / xp.maximum(h[2] * h[2], 1e-12)
    return xp.exp(-1.0 * tan2 / (roughness * roughness))


class Ward(AnalyticBrdf):
    """specular exp(-tan(theta_h)^2 / a^2) / (4 pi a^2 sqrt(cos theta_i cos theta_o)) (Ward 1992,
    "Measuring and Modeling Anisotropic Reflection", isotropic).
    """

    model = "ward"
    parameters = (DIFFUSE, SCALE, ROUGHNESS)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        a, cosines = values["roughness"], namespace(*wi, *wo).maximum(wi[2] * wo[2], 1e-12)
        lobe = gaussian(half_vector(wi, wo), a) / (4.0 * math.pi * a * a)
        return coated(values, lobe / namespace(cosines).sqrt(cosines))


class WardDuer(AnalyticBrdf):
    """:class:`Ward` without the square root (Duer 2006, "An Improved Normalization for the Ward
    Reflectance Model").
    """

    model = "ward-duer"
    parameters = (DIFFUSE, SCALE, ROUGHNESS)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        a, cosines = values["roughness"], namespace(*wi, *wo).maximum(wi[2] * wo[2], 1e-12)
        return coated(values, gaussian(half_vector(wi, wo), a) / (4.0 * math.pi * a * a * cosines))
