"""The shifted gamma distribution of Bagher, Soler and Holzschuch 2012, "Accurate Fitting of
Measured Reflectances Using a Shifted Gamma Micro-facet Distribution".
"""

from __future__ import annotations

import math

from nacre.analytic.fresnel import schlick
from nacre.analytic.gaussian import cosine_product
from nacre.analytic.model import DIFFUSE, SCALE, AnalyticBrdf, Parameter, Values, lambertian
from nacre.array import Array, Components, namespace
from nacre.geometry import dot, half_vector, to_spherical
from nacre.sampling.lobes import expm1

_LARGEST_EXPONENT = 40.0  # of the density, to stay a number of float32; published ones end at 5.4


def _color(name: str, low: float, high: float, start: tuple[float, float]) -> Parameter:
    return Parameter(name, low, high, start, color=True)


class Sgd(AnalyticBrdf):
    """specular F D G / (pi cos theta_i cos theta_o) over a Lambertian base, each per channel.

    - D = normalization exp(-x) / (x^p pi cos(theta_h)^4) with x = alpha + tan(theta_h)^2 / alpha;
    - F = Schlick's of `normal_reflectance`, less `slope` cos theta_d;
    - G = G1(wi) G1(wo), where G1 = 1 + lambda (1 - exp(c max(theta - theta_0, 0)^k)), and
      `log_c` is the natural logarithm of c, which runs over a hundred orders of magnitude.

    The paper derives the normalization and G1's parameters from alpha and p. Here they are
    parameters like others, as in the published table; a fit moves the product of specular and
    normalization only.
    """

    model = "sgd"
    parameters = (
        DIFFUSE,
        SCALE,
        _color("alpha", 1e-6, 10.0, (0.005, 0.3)),
        _color("p", -5.0, 10.0, (0.2, 1.2)),
        _color("normal_reflectance", 0.0, 10.0, (0.02, 0.5)),
        _color("slope", -10.0, 10.0, (-0.2, 0.2)),
        _color("normalisation", 0.0, 1e12, (1.0, 100.0)),
        _color("lambda", 0.0, 1e8, (1.0, 5.0)),
        _color("log_c", -50.0, 300.0, (-9.0, -2.0)),
        _color("k", 0.0, 1e3, (3.0, 15.0)),
        _color("theta_0", -10.0, 2.0, (-0.3, 0.5)),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        h = half_vector(wi, wo)
        cosine = dot(wi, h)
        cos2 = xp.maximum(h[2] * h[2], 1e-6)
        tan2 = (h[0] * h[0] + h[1] * h[1]) / cos2
        base, fresnel = lambertian(values), schlick(cosine, values["normal_reflectance"])
        light, view = to_spherical(wi)[0], to_spherical(wo)[0]
        scale = 1.0 / (math.pi * math.pi * cos2 * cos2 * cosine_product(wi, wo))

        def channel(k: int) -> Array:
            own = {name: values[name][k] for name in values}
            x = own["alpha"] + tan2 / own["alpha"]
            exponent = xp.minimum(-1.0 * x - own["p"] * xp.log(x), _LARGEST_EXPONENT)
            density = own["normalisation"] * xp.exp(exponent)
            visible = _visible(own, light) * _visible(own, view)
            reflected = xp.maximum(fresnel[k] - own["slope"] * cosine, 0.0)
            return base[k] + own["specular"] * reflected * density * visible * scale

        return channel(0), channel(1), channel(2)


def _visible(own: Values, theta: Array) -> Array:
    """G1, kept between 0 and 1."""
    xp = namespace(theta)
    excess = xp.maximum(theta - own["theta_0"], 1e-6)
    power = xp.exp(xp.minimum(own["log_c"] + own["k"] * xp.log(excess), 4.0))
    return xp.maximum(1.0 - own["lambda"] * expm1(power), 0.0)
