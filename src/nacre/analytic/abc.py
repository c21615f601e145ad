"""The ABC models of Low, Kronander, Ynnerman and Unger 2012, "BRDF Models for Accurate and
Efficient Rendering of Glossy Surfaces".

Both have a lobe S(x) = A / (1 + B x)^C, with a color A, over a Lambertian base.
"""

from __future__ import annotations

import math

from nacre.analytic.fresnel import fresnel
from nacre.analytic.gaussian import cosine_product, grooves
from nacre.analytic.model import DIFFUSE, INDEX, AnalyticBrdf, Parameter, Values, coated
from nacre.array import Array, Components, namespace
from nacre.geometry import dot, half_vector

_SHAPE = (
    Parameter("specular", 0.0, 1e7, (0.1, 1000.0), color=True),
    Parameter("b", 0.0, 1e9, (10.0, 1e5)),
    Parameter("c", 0.0, 20.0, (0.4, 2.5)),
)
"""A, B and C."""


class AbcMicrofacet(AnalyticBrdf):
    """F S(1 - cos theta_h) G / (pi cos theta_i cos theta_o), with G of V-shaped grooves and F of a
    dielectric of refractive index `index` (equation 15; pi as in the paper's table of fits).
    """

    model = "abc-microfacet"
    parameters = (DIFFUSE, *_SHAPE, INDEX)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        h = half_vector(wi, wo)
        # 1 - cos without the cancellation.
        height = (h[0] * h[0] + h[1] * h[1]) / (1.0 + namespace(*h).maximum(h[2], 0.0))
        facets = (
            fresnel(values, dot(wi, h)) * grooves(h, wi, wo) / (math.pi * cosine_product(wi, wo))
        )
        return coated(values, facets * _lobe(values, height))


class AbcSmooth(AnalyticBrdf):
    """F S(|p|^2), where p is the sum of the directions' projections on the surface, and F is that
    of a dielectric of refractive index `index` (equations 10 to 14).
    """

    model = "abc-smooth"
    parameters = (DIFFUSE, *_SHAPE, INDEX)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        x, y = wi[0] + wo[0], wi[1] + wo[1]
        across, along = wi[0] - wo[0], wi[1] - wo[1]
        cosine = xp.sqrt(xp.maximum(1.0 - 0.25 * (across * across + along * along), 1e-12))
        return coated(values, fresnel(values, cosine) * _lobe(values, x * x + y * y))


def _lobe(values: Values, x: Array) -> Array:
    """S(x) / A."""
    xp = namespace(x)
    return xp.exp(-1.0 * values["c"] * xp.log(1.0 + values["b"] * x))
