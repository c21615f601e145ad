"""Microfacets whose normals are a mixture of spherical Gaussians.

After Wang, Ren, Gong, Snyder and Guo 2009, "All-Frequency Rendering of Dynamic, Spatially-Varying
Reflectance", section 4: a mixture of isotropic lobes exp(sharpness (h_z - 1)) for the normals, with
Schlick's Fresnel term and smooth masking over a Lambertian base. Amplitudes are colors.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from nacre.analytic import AnalyticBrdf
from nacre.analytic.fresnel import fresnel
from nacre.analytic.ggx import masking_divisor
from nacre.analytic.model import DIFFUSE, NORMAL_REFLECTANCE, Parameter, Values, lambertian
from nacre.array import Components, namespace
from nacre.geometry import dot, half_vector

_SHARPNESS: Mapping[int, tuple[float, float]] = {
    1: (1.0, 4.0),
    2: (4.0, 15.0),
    3: (15.0, 60.0),
    4: (60.0, 250.0),
    5: (250.0, 1e3),
    6: (1e3, 1e4),
}
"""Where a fit of each lobe starts."""


class SphericalGaussians(AnalyticBrdf):
    """Six lobes: 29 numbers."""

    model = "spherical-gaussians"
    isotropy_known = True
    parameters: ClassVar[tuple[Parameter, ...]] = (
        DIFFUSE,
        NORMAL_REFLECTANCE,
        Parameter("masking", 0.01, 2.0, (0.1, 0.8)),
        *(Parameter(f"sharpness_{k}", 0.1, 1e5, start) for k, start in _SHARPNESS.items()),
        *(Parameter(f"amplitude_{k}", 0.0, 1e4, (0.01, 1.0), color=True) for k in _SHARPNESS),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp, h, alpha = namespace(*wi, *wo), half_vector(wi, wo), values["masking"]
        facets = fresnel(values, dot(wi, h)) / masking_divisor(wi, wo, (alpha, alpha))
        lobes = {k: facets * xp.exp(values[f"sharpness_{k}"] * (h[2] - 1.0)) for k in _SHARPNESS}
        red, green, blue = (
            base + sum(values[f"amplitude_{k}"][channel] * lobe for k, lobe in lobes.items())
            for channel, base in enumerate(lambertian(values))
        )
        return red, green, blue
