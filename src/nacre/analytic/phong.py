"""Powers of a cosine: Blinn-Phong, Lafortune, and Ashikhmin and Shirley."""

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

EXPONENT = Parameter("exponent", 0.0, 1e6, (2.0, 2000.0))


def power(base: Array, exponent: Array) -> Array:
    """`base` to a power, with derivatives that stay finite at a base of 0."""
    xp = namespace(base)
    return xp.exp(exponent * xp.log(xp.maximum(base, 1e-12)))


class BlinnPhong(AnalyticBrdf):
    """A power of cos theta_h: specular (n + 2) / (2 pi) cos(theta_h)^n (Blinn 1977; normalized
    after Ngan et al. 2005).
    """

    model = "blinn-phong"
    parameters = (DIFFUSE, SCALE, EXPONENT)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        n = values["exponent"]
        lobe = (n + 2.0) / (2.0 * math.pi) * power(half_vector(wi, wo)[2], n)
        return coated(values, lobe)


class Lafortune(AnalyticBrdf):
    """One lobe of Lafortune et al. 1997, "Non-Linear Approximation of Reflectance Functions".

    specular (n + 2) / (2 pi) (C_xy (x x' + y y') + C_z z z')^n / max(|C_xy|, |C_z|)^n; `c_xy` is
    negative of a lobe about the mirror direction. Only the ratio of `c_xy` and `c_z` matters.
    """

    model = "lafortune"
    parameters = (
        DIFFUSE,
        SCALE,
        Parameter("c_xy", -2.0, 2.0, (-1.0, -0.4)),
        Parameter("c_z", -2.0, 2.0, (0.3, 1.0)),
        EXPONENT,
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        n, across, along = values["exponent"], values["c_xy"], values["c_z"]
        xp = namespace(across)
        scale = xp.maximum(xp.maximum(abs(across), abs(along)), 1e-12)
        if isinstance(across, float):
            scale = float(scale)
        base = (across * (wi[0] * wo[0] + wi[1] * wo[1]) + along * wi[2] * wo[2]) / scale
        return coated(values, (n + 2.0) / (2.0 * math.pi) * power(base, n))


class AshikhminShirley(AnalyticBrdf):
    """The isotropic lobe of Ashikhmin and Shirley 2000, "An Anisotropic Phong BRDF Model".

    specular F (n + 1) cos(theta_h)^n / (8 pi cos(theta_d) max(cos theta_i, cos theta_o)) over a
    Lambertian base, with Schlick's F of `normal_reflectance`.
    """

    model = "ashikhmin-shirley"
    parameters = (DIFFUSE, SCALE, EXPONENT, NORMAL_REFLECTANCE)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp, n = namespace(*wi, *wo), values["exponent"]
        h = half_vector(wi, wo)
        cosine = dot(wi, h)
        height = xp.maximum(xp.maximum(wi[2], wo[2]), 1e-6)
        lobe = (n + 1.0) / (8.0 * math.pi) * power(h[2], n) / (xp.maximum(cosine, 1e-6) * height)
        return coated(values, lobe * fresnel(values, cosine))


class DielectricAshikhminShirley(AshikhminShirley):
    """:class:`AshikhminShirley` with the F of a dielectric of refractive index `index`, as Low et
    al. 2012 fit it.
    """

    model = "ashikhmin-shirley-dielectric"
    parameters = (DIFFUSE, SCALE, EXPONENT, INDEX)
