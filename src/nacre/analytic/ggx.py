"""GGX microfacets over a Lambertian base.

D is the distribution of Trowbridge and Reitz 1975, which Walter et al. 2007 ("Microfacet Models for
Refraction through Rough Surfaces") named GGX; G is Smith's with heights correlated (Heitz 2014,
"Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", equation 99); F is
Schlick's. With the lengths |w|_alpha = sqrt((alpha_x w_x)^2 + (alpha_y w_y)^2 + w_z^2), the terms
combine to

    f = diffuse / pi + F D / (2 (wi_z |wo|_alpha + wo_z |wi|_alpha)).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import ClassVar

from nacre.analytic.fresnel import schlick
from nacre.analytic.model import DIFFUSE, AnalyticBrdf, Parameter, Values, lambertian
from nacre.array import Array, Components, namespace
from nacre.brdf import Sampler
from nacre.color import luminance
from nacre.geometry import dot, half_vector, rotate
from nacre.sampling import GgxLobe, GgxMixture
from nacre.sampling.visible_normals import MIN_ROUGHNESS, distribution, stretched_length

_MIN_LENGTHS = 1e-24  # of directions at the horizon

SPECULAR = Parameter("specular", 0.0, 1.0, (0.02, 0.8), color=True)
"""F0, the Fresnel reflectance at normal incidence."""


def _roughness(name: str) -> Parameter:
    return Parameter(name, MIN_ROUGHNESS, 1.0, (0.01, 0.8))


class Ggx(AnalyticBrdf):
    """Isotropic GGX: `diffuse` and `specular` colors and `roughness`, which is alpha."""

    model = "ggx"
    parameters: ClassVar[tuple[Parameter, ...]] = (DIFFUSE, SPECULAR, _roughness("roughness"))

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        alpha, angle = _axes(values)
        if angle is not None:
            wi, wo = rotate(wi, -1.0 * angle), rotate(wo, -1.0 * angle)
        h = half_vector(wi, wo)
        facets = ggx_facets(wi, wo, h, alpha)
        fresnel = schlick(dot(wi, h), values["specular"])
        base = lambertian(values)
        red, green, blue = (d + f * facets for d, f in zip(base, fresnel, strict=True))
        return red, green, blue

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """Visible normals, about as often as the facets add to the albedo, else the cosine."""
        (x, y), angle = _axes(self.values)
        specular, diffuse = (luminance(self.operands[name]) for name in ("specular", "diffuse"))
        specular += 0.05  # what Schlick adds off normal incidence
        fraction = float(min(max(specular / (specular + diffuse), 0.1), 0.95))
        return GgxMixture((GgxLobe((fraction,), (x,), (y,), (0.0,)),), angle=angle)


def ggx_facets(wi: Components, wo: Components, h: Components, alpha: tuple[Array, Array]) -> Array:
    """f_r in 1/sr of microfacets that reflect everything: D G / (4 wi_z wo_z), for roughnesses
    along the axes and the half vector h.
    """
    return distribution(h, alpha) / masking_divisor(wi, wo, alpha)


def masking_divisor(wi: Components, wo: Components, alpha: tuple[Array, Array]) -> Array:
    """What D is divided by: 4 wi_z wo_z / G, with heights correlated (Heitz 2014).

    It vanishes where both directions are at the horizon, but not so far that f_r would overflow,
    for layers take differences of it.
    """
    lengths = wi[2] * stretched_length(wo, alpha) + wo[2] * stretched_length(wi, alpha)
    return 2.0 * namespace(*wi, *wo).maximum(lengths, _MIN_LENGTHS)


class AnisotropicGgx(Ggx):
    """GGX with two roughnesses: `roughness_x` along an axis rotated by `angle` (radians) from +x
    toward +y, `roughness_y` across it.
    """

    model = "ggx-anisotropic"
    isotropic = False
    parameters = (
        DIFFUSE,
        SPECULAR,
        _roughness("roughness_x"),
        _roughness("roughness_y"),
        Parameter("angle", -0.5 * math.pi, 0.5 * math.pi, (-0.4 * math.pi, 0.4 * math.pi)),
    )


def _axes(values: Values) -> tuple[tuple[Array, Array], Array | None]:
    """Roughnesses along two axes, and the angle of the first from +x; None where they are equal."""
    if "angle" not in values:
        return (values["roughness"], values["roughness"]), None
    return (values["roughness_x"], values["roughness_y"]), values["angle"]
