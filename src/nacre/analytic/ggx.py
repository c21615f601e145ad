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
from dataclasses import dataclass
from functools import cached_property

from nacre.analytic.fresnel import schlick
from nacre.analytic.model import DIFFUSE, AnalyticBrdf, Parameter, Values, lambertian
from nacre.array import Array, Components, namespace
from nacre.brdf import Sampler
from nacre.color import luminance
from nacre.geometry import cosine_hemisphere, dot, half_vector, normalize, reflect, turn

SPECULAR = Parameter("specular", 0.0, 1.0, (0.02, 0.8), colour=True)
"""F0, the Fresnel reflectance at normal incidence."""

LEAST_ROUGHNESS = 1e-3
"""Below it float32 half vectors do not resolve the lobe."""


def _roughness(name: str) -> Parameter:
    return Parameter(name, LEAST_ROUGHNESS, 1.0, (0.01, 0.8))


class Ggx(AnalyticBrdf):
    """Isotropic GGX: `diffuse` and `specular` colours and `roughness`, which is alpha."""

    model = "ggx"
    parameters = (DIFFUSE, SPECULAR, _roughness("roughness"))

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        """See :class:`AnalyticBrdf`."""
        return _ggx(values, (values["roughness"], values["roughness"]), wi, wo)

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """Visible normals."""
        roughness = self.values["roughness"]
        return GgxSampler(_specular_share(self.values), (roughness, roughness))  # type: ignore[arg-type]


class AnisotropicGgx(AnalyticBrdf):
    """GGX with two roughnesses: `roughness_x` along an axis turned by `angle` (radians) from +x
    towards +y, `roughness_y` across it.
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
        """See :class:`AnalyticBrdf`."""
        angle, alpha = values["angle"], (values["roughness_x"], values["roughness_y"])
        return _ggx(values, alpha, turn(wi, -1.0 * angle), turn(wo, -1.0 * angle))

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """Visible normals."""
        x, y, angle = (self.values[k] for k in ("roughness_x", "roughness_y", "angle"))
        return GgxSampler(_specular_share(self.values), (x, y), angle)  # type: ignore[arg-type]


def _ggx(values: Values, alpha: tuple[Array, Array], wi: Components, wo: Components) -> Components:
    """f_r for directions in the frame of the roughnesses."""
    h = half_vector(wi, wo)
    shadowing = 2.0 * (wi[2] * stretched_length(wo, alpha) + wo[2] * stretched_length(wi, alpha))
    facets = distribution(h, alpha) / shadowing
    fresnel = schlick(dot(wi, h), values["specular"])
    base = lambertian(values)
    red, green, blue = (d + f * facets for d, f in zip(base, fresnel, strict=True))
    return red, green, blue


def distribution(h: Components, alpha: tuple[Array, Array]) -> Array:
    """D of GGX in 1/sr, of which D cos theta_h integrates to 1 over the hemisphere."""
    # The sum of squares keeps its precision where 1 - cos^2 has none left.
    x, y = h[0] / alpha[0], h[1] / alpha[1]
    squares = x * x + y * y + h[2] * h[2]
    return 1.0 / (math.pi * alpha[0] * alpha[1] * squares * squares)


def stretched_length(w: Components, alpha: tuple[Array, Array]) -> Array:
    """Length of `w` in the space in which the microfacets are a hemisphere."""
    xp = namespace(*w)
    x, y = alpha[0] * w[0], alpha[1] * w[1]
    return xp.sqrt(x * x + y * y + w[2] * w[2])


@dataclass(frozen=True)
class GgxSampler:
    """A cosine lobe, and the mirror directions of visible GGX normals (Heitz 2018).

    Parameters
    ----------
    specular
        Probability of the visible normals, in [0, 1].
    alpha
        Roughnesses along x and y.
    angle
        Of that x from the frame's, radians.

    References
    ----------
    Heitz 2018, "Sampling the GGX Distribution of Visible Normals"; Dupuy and Benyoub 2023,
    "Sampling Visible GGX Normals with Spherical Caps".
    """

    specular: float
    alpha: tuple[float, float]
    angle: float = 0.0

    def __str__(self) -> str:
        return f"{self.specular:.0%} visible GGX normals, else cosine"

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """See :class:`nacre.brdf.Sampler`; u[0] selects the lobe."""
        xp = namespace(*wo, *u)
        view = turn(wo, -self.angle)
        x, y = self.alpha
        # A cap of the unit sphere about the stretched view: its normals are half-way to the view.
        stretched = normalize((x * view[0], y * view[1], view[2]))
        z = (1.0 - u[1]) * (1.0 + stretched[2]) - stretched[2]
        radius = xp.sqrt(xp.maximum(1.0 - z * z, 0.0))
        phi = 2.0 * math.pi * u[2]
        normal = (
            x * (radius * xp.cos(phi) + stretched[0]),
            y * (radius * xp.sin(phi) + stretched[1]),
            z + stretched[2],
        )
        mirrored = turn(reflect(view, normalize(normal)), self.angle)
        cosine = cosine_hemisphere(u[1], u[2])
        chosen = u[0] < self.specular
        a, b, c = (xp.where(chosen, m, k) for m, k in zip(mirrored, cosine, strict=True))
        return (a, b, c), self.pdf_components((a, b, c), wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        """See :class:`nacre.brdf.Sampler`."""
        xp = namespace(*wi, *wo)
        light, view = turn(wi, -self.angle), turn(wo, -self.angle)
        # D_v / (4 wo.h) = G1 D / (4 cos theta_o), with G1 of a single direction.
        d = distribution(half_vector(light, view), self.alpha)
        mirrored = d / (2.0 * (view[2] + stretched_length(view, self.alpha)))
        visible = (wi[2] > 0.0) & (wo[2] > 0.0)
        mixture = self.specular * mirrored + (1.0 - self.specular) / math.pi * wi[2]
        return xp.where(visible, mixture, 0.0 * mixture)


def _specular_share(values: Values) -> float:
    """How often to draw visible normals: about as much as the facets add to the albedo."""
    specular, diffuse = luminance(values["specular"]), luminance(values["diffuse"])
    specular += 0.05  # what Schlick adds off normal incidence
    return float(min(max(specular / (specular + diffuse), 0.1), 0.95))
