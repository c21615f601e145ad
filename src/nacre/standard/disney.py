"""Disney's principled BRDF as Mitsuba 3 evaluates it (plugin `principled`), without transmission.

Burley 2012, "Physically Based Shading at Disney", and 2015, "Extending the Disney BRDF to a BSDF
with Integrated Subsurface Scattering": section 5.3 and the course notes' appendix for the diffuse
lobes. Masking is separable; the coat's facets are GTR1 with Mitsuba's range of gloss.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from nacre.analytic.fresnel import dielectric
from nacre.analytic.model import AnalyticBrdf, Parameter, Values
from nacre.array import Array, Components, namespace
from nacre.color import luminance
from nacre.geometry import dot, half_vector
from nacre.sampling.visible_normals import MIN_ROUGHNESS, distribution, stretched_length
from nacre.standard.parameter_math import GRAZING, color_parameter, fraction, of_numbers

_COAT_NORMAL = 0.04  # the coat's reflectance at normal incidence
_COAT_MASKING = 0.25  # roughness in its masking


class Disney(AnalyticBrdf):
    """Mitsuba's `principled` without anisotropy; parameters have the same names."""

    model = "disney"
    fitted_on: ClassVar[Literal["samples", "pictures"]] = "pictures"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        color_parameter("base_color"),
        fraction("metallic"),
        fraction("roughness", (0.1, 0.8)),
        Parameter("eta", 1.0, 4.0, (1.3, 1.8)),
        fraction("spec_tint"),
        fraction("flatness"),
        fraction("sheen", (0.02, 0.5)),
        fraction("sheen_tint"),
        fraction("clearcoat"),
        fraction("clearcoat_gloss"),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        wi, wo = ((w[0], w[1], xp.maximum(w[2], GRAZING)) for w in (wi, wo))
        h = half_vector(wi, wo)
        cosine = xp.minimum(dot(wi, h), 1.0)
        rise = _rise(cosine)
        color, metallic, sheen_tint = (values[k] for k in ("base_color", "metallic", "sheen_tint"))
        bright = luminance(color)
        hues = [c / of_numbers("maximum", bright, 1e-9) for c in color]

        facets = _facets(wi, wo, h, _axes(values))
        glass = dielectric(cosine, values["eta"])
        root = (values["eta"] - 1.0) / (values["eta"] + 1.0)
        coat = values["clearcoat"] * _coat(values["clearcoat_gloss"], wi, wo, h, rise)
        diffuse = (1.0 - metallic) * _diffuse(values, wi, wo, cosine)
        found = []
        for c, hue in zip(color, hues, strict=True):
            normal = root * root * hue
            tinted = glass + values["spec_tint"] * (normal + (1.0 - normal) * rise - glass)
            fresnel = (1.0 - metallic) * tinted + metallic * (c + (1.0 - c) * rise)
            fibers = values["sheen"] * (1.0 - metallic) * (1.0 - sheen_tint + sheen_tint * hue)
            found.append(fresnel * facets + coat + diffuse * c + fibers * rise)
        red, green, blue = found
        return red, green, blue


class AnisotropicDisney(Disney):
    """Mitsuba's `principled`: rougher along x, less rough along y."""

    model = "disney-anisotropic"
    isotropic = False
    parameters = (*Disney.parameters, fraction("anisotropic", (0.1, 0.8)))


def _axes(values: Values) -> tuple[Array, Array]:
    """Roughness alpha along x and y."""
    alpha = values["roughness"] * values["roughness"]
    aspect: Array = 1.0
    if "anisotropic" in values:
        aspect = of_numbers("sqrt", 1.0 - 0.9 * values["anisotropic"])
    x, y = (of_numbers("maximum", a, MIN_ROUGHNESS) for a in (alpha / aspect, alpha * aspect))
    return x, y


def _rise(cosine: Array) -> Array:
    """Schlick's weight (1 - cos)^5."""
    grazing = namespace(cosine).maximum(1.0 - cosine, 0.0)
    square = grazing * grazing
    return square * square * grazing


def _facets(wi: Components, wo: Components, h: Components, alpha: tuple[Array, Array]) -> Array:
    """f_r in 1/sr for GGX facets that reflect everything; each direction is masked separately."""
    masked = (wi[2] + stretched_length(wi, alpha)) * (wo[2] + stretched_length(wo, alpha))
    return distribution(h, alpha) / masked


def _coat(gloss: Array, wi: Components, wo: Components, h: Components, rise: Array) -> Array:
    """f_r in 1/sr for the coat, with Disney's scale."""
    alpha = 0.1 + (0.001 - 0.1) * gloss
    square = alpha * alpha
    scale = (square - 1.0) / (math.pi * of_numbers("log", square))
    # 1 + (alpha^2 - 1) h_z^2 without cancellation
    facets = scale / (h[0] * h[0] + h[1] * h[1] + square * h[2] * h[2])
    masks = [
        2.0 * w[2] / (w[2] + stretched_length(w, (_COAT_MASKING, _COAT_MASKING))) for w in (wi, wo)
    ]
    return 0.25 * (_COAT_NORMAL + (1.0 - _COAT_NORMAL) * rise) * facets * masks[0] * masks[1]


def _diffuse(values: Values, wi: Components, wo: Components, cosine: Array) -> Array:
    """f_r in 1/sr for a white base: diffuse and retro-reflection, or a flatter lobe."""
    light, view = _rise(wi[2]), _rise(wo[2])
    back = 2.0 * values["roughness"] * cosine * cosine
    rough = (1.0 - 0.5 * light) * (1.0 - 0.5 * view) + back * (
        light + view + light * view * (back - 1.0)
    )
    at_90 = 0.5 * back
    both = (1.0 + (at_90 - 1.0) * light) * (1.0 + (at_90 - 1.0) * view)
    flat = 1.25 * (both * (1.0 / (wi[2] + wo[2]) - 0.5) + 0.5)
    return (rough + values["flatness"] * (flat - rough)) * (1.0 / math.pi)
