"""Mixtures of lobes with exact densities."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nacre.array import Array, Components, namespace
from nacre.brdf import Sampler
from nacre.geometry import cosine_hemisphere, dot, half_vector, reflect, uniform_hemisphere

MAX_EXPONENT = 1e5  # sharpest lobe: beyond it float32 half vectors no longer resolve it

_SMALL = 0.03  # below it a series replaces the difference of two numbers near 1


class UniformSampler(Sampler):
    """Density 1 / (2 pi) over the hemisphere, whatever the view, for comparison."""

    kind = "uniform"
    adapted = False

    def __str__(self) -> str:
        return "uniform"

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        wi = uniform_hemisphere(u[1], u[2])
        return wi, self.pdf_components(wi, wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        return 0.5 / math.pi + 0.0 * wi[2] + 0.0 * wo[2]


@dataclass(frozen=True)
class BlinnPhongMixture(Sampler):
    """A cosine lobe and a Blinn-Phong lobe of half vectors (NBRDF paper, section 3.3; Blinn 1977).

    The half vector h has density (n + 1) / (2 pi) cos(theta_h)^n over solid angle and `wi` is `wo`
    mirrored about it, so that p(wi) = p(h) / (4 wo.h). What falls below the horizon has density 0:
    the density integrates to less than one at grazing views.
    """

    kind = "cosine + Blinn-Phong"

    specular: float  # probability of the Blinn-Phong lobe, in [0, 1]
    exponent: float  # n, in [0, MAX_EXPONENT]

    def __str__(self) -> str:
        return f"{self.specular:.0%} Blinn-Phong of exponent {self.exponent:.4g}, else cosine"

    def __post_init__(self) -> None:
        if not 0.0 <= self.specular <= 1.0:
            raise ValueError(f"specular must lie in [0, 1], got {self.specular}")
        if not 0.0 <= self.exponent <= MAX_EXPONENT:
            raise ValueError(f"exponent must lie in [0, {MAX_EXPONENT:g}], got {self.exponent}")

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> BlinnPhongMixture:
        return cls(float(description["specular"]), float(description["exponent"]))

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """See :class:`nacre.brdf.Sampler`; u[0] selects the lobe."""
        xp = namespace(*wo, *u)
        tan2 = expm1(-2.0 / (self.exponent + 1.0) * xp.log(1.0 - u[1]))
        cos_theta = 1.0 / xp.sqrt(1.0 + tan2)
        sin_theta = cos_theta * xp.sqrt(tan2)
        phi = 2.0 * math.pi * u[2]
        mirrored = reflect(wo, (sin_theta * xp.cos(phi), sin_theta * xp.sin(phi), cos_theta))
        cosine = cosine_hemisphere(u[1], u[2])
        chosen = u[0] < self.specular
        x, y, z = (xp.where(chosen, m, c) for m, c in zip(mirrored, cosine, strict=True))
        return (x, y, z), self.pdf_components((x, y, z), wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        xp = namespace(*wi, *wo)
        mirrored = blinn_phong_density(half_vector(wi, wo), wo, self.exponent)
        visible = (wi[2] > 0.0) & (wo[2] > 0.0)
        mixture = self.specular * mirrored + (1.0 - self.specular) / math.pi * wi[2]
        return xp.where(visible, mixture, 0.0 * mixture)


def blinn_phong_density(h: Components, wo: Components, exponent: Array) -> Array:
    """Density in 1/sr of `wo` mirrored about half vectors h from a Blinn-Phong lobe."""
    xp = namespace(*h)
    cos_theta = xp.maximum(h[2], 1e-12)
    tan2 = (h[0] * h[0] + h[1] * h[1]) / (cos_theta * cos_theta)
    power = xp.exp(-0.5 * exponent * log1p(tan2))
    lobe = (exponent + 1.0) / (2.0 * math.pi) * power
    return lobe / (4.0 * xp.maximum(dot(wo, h), 1e-6))


# A sharp lobe lives on angles whose cosine float32 rounds to a handful of values near 1: a density
# from cos(theta)^n is off by 0.2 % (rms) at n = 50000, one from the squared tangent by 6e-6.


def expm1(x: Array) -> Array:
    """`exp(x)` - 1 for `x` >= 0, to 2e-6 in float32."""
    xp = namespace(x)
    y = xp.minimum(x, _SMALL)
    series = y * (1.0 + y * (1.0 / 2.0 + y * (1.0 / 6.0 + y / 24.0)))
    return xp.where(x < _SMALL, series, xp.exp(x) - 1.0)


def log1p(x: Array) -> Array:
    """Logarithm of 1 + `x` for `x` >= 0, to 2e-6 in float32."""
    xp = namespace(x)
    y = xp.minimum(x, _SMALL)
    series = y * (1.0 - y * (1.0 / 2.0 - y * (1.0 / 3.0 - y * (1.0 / 4.0 - y / 5.0))))
    return xp.where(x < _SMALL, series, xp.log(1.0 + x))
