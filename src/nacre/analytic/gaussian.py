"""Gaussians of the slope: Ward's lobe, Duer's normalization of it, and Cook and Torrance's."""

from __future__ import annotations

import math

from nacre.analytic.fresnel import fresnel
from nacre.analytic.model import (
    DIFFUSE,
    INDEX,
    NORMAL_REFLECTANCE,
    SCALE,
    AnalyticBrdf,
    Parameter,
    Values,
    coated,
)
from nacre.array import Array, Components, namespace
from nacre.geometry import dot, half_vector

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
        a, cosines = values["roughness"], cosine_product(wi, wo)
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
        a, cosines = values["roughness"], cosine_product(wi, wo)
        return coated(values, gaussian(half_vector(wi, wo), a) / (4.0 * math.pi * a * a * cosines))


class CookTorrance(AnalyticBrdf):
    """specular F D G / (pi cos theta_i cos theta_o) over a Lambertian base (Cook and Torrance 1982,
    "A Reflectance Model for Computer Graphics").

    D = exp(-tan(theta_h)^2 / m^2) / (m^2 cos(theta_h)^4), as Cook and Torrance put it: a factor pi
    larger than Beckmann's normalized density. G is that of V-shaped grooves, F that of a
    dielectric of refractive index `index`.
    """

    model = "cook-torrance"
    parameters = (DIFFUSE, SCALE, ROUGHNESS, INDEX)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        facets, cosine = _facets(values["roughness"], wi, wo)
        return coated(values, facets * fresnel(values, cosine))


class SchlickCookTorrance(AnalyticBrdf):
    """:class:`CookTorrance` with D normalized and Schlick's F of `normal_reflectance`, as Ngan et
    al. 2005 fit it.
    """

    model = "cook-torrance-schlick"
    parameters = (DIFFUSE, SCALE, ROUGHNESS, NORMAL_REFLECTANCE)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        facets, cosine = _facets(values["roughness"], wi, wo)
        return coated(values, facets / math.pi * fresnel(values, cosine))


def grooves(h: Components, wi: Components, wo: Components) -> Array:
    """Fraction of V-shaped grooves neither shadowed nor masked (Torrance and Sparrow 1967)."""
    xp = namespace(*wi, *wo)
    scale = 2.0 * h[2] / xp.maximum(dot(wi, h), 1e-6)
    return xp.minimum(xp.minimum(scale * wi[2], scale * wo[2]), 1.0)


def cosine_product(wi: Components, wo: Components) -> Array:
    """Cos theta_i cos theta_o, kept above 0."""
    return namespace(*wi, *wo).maximum(wi[2] * wo[2], 1e-12)


def _facets(roughness: Array, wi: Components, wo: Components) -> tuple[Array, Array]:
    """D G / (pi cos theta_i cos theta_o), and cos theta_d."""
    xp = namespace(*wi, *wo)
    h = half_vector(wi, wo)
    cos2 = xp.maximum(h[2] * h[2], 1e-6)
    density = gaussian(h, roughness) / (roughness * roughness * cos2 * cos2)
    facets = density * grooves(h, wi, wo) / (math.pi * cosine_product(wi, wo))
    return facets, dot(wi, h)
