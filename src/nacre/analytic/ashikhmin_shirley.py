"""Ashikhmin and Shirley 2000, "An Anisotropic Phong BRDF Model": its isotropic lobe."""

from __future__ import annotations

import math

from nacre.analytic.fresnel import dielectric, schlick_one
from nacre.analytic.model import (
    DIFFUSE,
    INDEX,
    NORMAL_REFLECTANCE,
    SCALE,
    AnalyticBrdf,
    Values,
    coated,
)
from nacre.analytic.phong import EXPONENT, power
from nacre.array import Array, Components, namespace
from nacre.geometry import dot, half_vector


class AshikhminShirley(AnalyticBrdf):
    """specular F (n + 1) cos(theta_h)^n / (8 pi cos(theta_d) max(cos theta_i, cos theta_o)) over a
    Lambertian base, with Schlick's F of `normal_reflectance`.
    """

    model = "ashikhmin-shirley"
    parameters = (DIFFUSE, SCALE, EXPONENT, NORMAL_REFLECTANCE)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        lobe, cosine = _lobe(values["exponent"], wi, wo)
        return coated(values, lobe * schlick_one(cosine, values["normal_reflectance"]))


class DielectricAshikhminShirley(AnalyticBrdf):
    """:class:`AshikhminShirley` with the F of a dielectric of refractive index `index`, as Low et
    al. 2012 fit it.
    """

    model = "ashikhmin-shirley-dielectric"
    parameters = (DIFFUSE, SCALE, EXPONENT, INDEX)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        lobe, cosine = _lobe(values["exponent"], wi, wo)
        return coated(values, lobe * dielectric(cosine, values["index"]))


def _lobe(n: Array, wi: Components, wo: Components) -> tuple[Array, Array]:
    """The lobe without Fresnel's term, and cos theta_d."""
    xp = namespace(*wi, *wo)
    h = half_vector(wi, wo)
    cosine = dot(wi, h)
    height = xp.maximum(xp.maximum(wi[2], wo[2]), 1e-6)
    lobe = (n + 1.0) / (8.0 * math.pi) * power(h[2], n)
    return lobe / (xp.maximum(cosine, 1e-6) * height), cosine
