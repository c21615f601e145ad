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

from nacre.analytic.fresnel import schlick
from nacre.analytic.model import DIFFUSE, AnalyticBrdf, Parameter, Values, lambertian
from nacre.array import Array, Components
from nacre.brdf import Sampler
from nacre.color import luminance
from nacre.geometry import dot, half_vector, rotate
from nacre.sampling import GgxLobe, GgxMixture
from nacre.sampling.visible_normals import MIN_ROUGHNESS, distribution, stretched_length

SPECULAR = Parameter("specular", 0.0, 1.0, (0.02, 0.8), color=True)
"""F0, the Fresnel reflectance at normal incidence."""


def _roughness(name: str) -> Parameter:
    return Parameter(name, MIN_ROUGHNESS, 1.0, (0.01, 0.8))


class Ggx(AnalyticBrdf):
    """Isotropic GGX: `diffuse` and `specular` colors and `roughness`, which is alpha."""

    model = "ggx"
    parameters = (DIFFUSE, SPECULAR, _roughness("roughness"))

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        return _ggx(values, (values["roughness"], values["roughness"]), wi, wo)

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """Visible normals."""
        roughness = self.values["roughness"]
        return _sampler(self.values, (roughness, roughness), None)  # type: ignore[arg-type]


class AnisotropicGgx(AnalyticBrdf):
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

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        angle, alpha = values["angle"], (values["roughness_x"], values["roughness_y"])
        return _ggx(values, alpha, rotate(wi, -1.0 * angle), rotate(wo, -1.0 * angle))

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """Visible normals."""
        x, y, angle = (self.values[k] for k in ("roughness_x", "roughness_y", "angle"))
        return _sampler(self.values, (x, y), angle)  # type: ignore[arg-type]


def _ggx(values: Values, alpha: tuple[Array, Array], wi: Components, wo: Components) -> Components:
    """f_r for directions in the frame of the roughnesses."""
    h = half_vector(wi, wo)
    shadowing = 2.0 * (wi[2] * stretched_length(wo, alpha) + wo[2] * stretched_length(wi, alpha))
    facets = distribution(h, alpha) / shadowing
    fresnel = schlick(dot(wi, h), values["specular"])
    base = lambertian(values)
    red, green, blue = (d + f * facets for d, f in zip(base, fresnel, strict=True))
    return red, green, blue


def _sampler(values: Values, alpha: tuple[float, float], angle: float | None) -> GgxMixture:
    """Visible normals, drawn about as often as the facets add to the albedo, else the cosine."""
    specular, diffuse = luminance(values["specular"]), luminance(values["diffuse"])
    specular += 0.05  # what Schlick adds off normal incidence
    fraction = float(min(max(specular / (specular + diffuse), 0.1), 0.95))
    return GgxMixture((GgxLobe((fraction,), (alpha[0],), (alpha[1],), (0.0,)),), angle=angle)
