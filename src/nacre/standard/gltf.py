"""The material of glTF 2.0 with its ratified extensions for reflection.

Metallic-roughness as in appendix B of the specification, with KHR_materials_ior, _specular,
_iridescence, _anisotropy, _sheen and _clearcoat; parameters are named as in files. From the inside
out, with w = (1 - v.h)^5 and GGX facets that reflect everything (f_s),

    dielectric = (1 - F_d) baseColor / pi + F_d f_s,   F_d = f0 + (specular - f0) w,
    metal      = F_m f_s,                              F_m = baseColor + (1 - baseColor) w,
    base       = dielectric + metallic (metal - dielectric),
    velvet     = sheenColor f_c + (1 - max(sheenColor) max(E(v.n), E(l.n))) base,
    coated     = velvet + clearcoat F(v.n) (f_coat - velvet).

A film's reflectance replaces F_d and F_m by its fraction; below it remains 1 minus the largest
channel. The film and the coat use the angle of the viewer, as in the extensions and in viewers, so
exchanging the directions changes them. KHR_materials_specular has the largest channel of F_d in
1 - F_d too; the viewers of Khronos and of three.js use each channel's own, as here.
"""

from __future__ import annotations

import math
from typing import ClassVar

from nacre.analytic.fresnel import schlick
from nacre.analytic.ggx import ggx_facets
from nacre.analytic.model import AnalyticBrdf, Parameter, Values
from nacre.array import Array, Components, namespace
from nacre.geometry import dot, half_vector, rotate
from nacre.sampling.visible_normals import MIN_ROUGHNESS
from nacre.standard.iridescence import Film
from nacre.standard.parameter_math import WIDE_GAMUT, color_parameter, largest, of_numbers
from nacre.standard.sheen import charlie, charlie_albedo

MAX_INDEX = 5.0  # germanium has 4; the specification sets no limit
MAX_SPECULAR_COLOR = 25.0  # total reflection at index 1.5; the specification sets no limit
MAX_THICKNESS = 1e4  # nm, far beyond where interference shows; the specification sets no limit

_THINNEST = 0.03  # nm; below, viewers fade the film out
_COAT = 0.04  # reflectance of a coat of index 1.5


class Gltf(AnalyticBrdf):
    """glTF's material; roughnesses are roots of alpha, the film's thickness is in nm."""

    model = "gltf"
    by_design: ClassVar = {
        "reciprocity": "its film and coat use the viewer's angle alone, as the extensions say"
    }
    fitted_on = "pictures"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        color_parameter("baseColorFactor"),
        Parameter("metallicFactor", 0.0, 1.0, (0.0, 1.0)),
        Parameter("roughnessFactor", 0.0, 1.0, (0.1, 0.9)),
        Parameter("ior", 1.0, MAX_INDEX, (1.3, 2.0)),
        Parameter("specularFactor", 0.0, 1.0, (0.3, 1.0)),
        Parameter(
            "specularColorFactor",
            *(0.0, MAX_SPECULAR_COLOR, (0.3, 2.0)),
            color=True,
            allowed=(WIDE_GAMUT[0], MAX_SPECULAR_COLOR),
        ),
        Parameter("iridescenceFactor", 0.0, 1.0, (0.0, 0.5)),
        Parameter("iridescenceIor", 1.0, MAX_INDEX, (1.2, 2.0)),
        Parameter("iridescenceThicknessMaximum", 0.0, MAX_THICKNESS, (100.0, 600.0)),
        color_parameter("sheenColorFactor", (0.0, 0.5)),
        Parameter("sheenRoughnessFactor", 0.0, 1.0, (0.2, 0.8)),
        Parameter("clearcoatFactor", 0.0, 1.0, (0.0, 1.0)),
        Parameter("clearcoatRoughnessFactor", 0.0, 1.0, (0.05, 0.5)),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        if "anisotropyRotation" in values:
            angle = -1.0 * values["anisotropyRotation"]
            wi, wo = rotate(wi, angle), rotate(wo, angle)
        h = half_vector(wi, wo)
        velvet = _velvet(values, _base(values, h, wi, wo), h, wi, wo)
        fresnel = values["clearcoatFactor"] * schlick(wo[2], (_COAT,) * 3)[0]
        alpha = _alpha(values["clearcoatRoughnessFactor"])
        coat = ggx_facets(wi, wo, h, (alpha, alpha))
        red, green, blue = (f + fresnel * (coat - f) for f in velvet)
        return red, green, blue


class AnisotropicGltf(Gltf):
    """:class:`Gltf` with a base that is rougher along an axis, by `anisotropyStrength`.

    `anisotropyRotation` (radians) rotates the axis from +x toward +y.
    """

    model = "gltf-anisotropic"
    isotropic = False
    parameters = (
        *Gltf.parameters,
        Parameter("anisotropyStrength", 0.0, 1.0, (0.1, 0.9)),
        Parameter(
            "anisotropyRotation", -0.5 * math.pi, 0.5 * math.pi, (-0.4 * math.pi, 0.4 * math.pi)
        ),
    )


def dielectric_reflectance(values: Values) -> tuple[Array, Array, Array]:
    """f0 of the dielectric without `specularFactor` (KHR_materials_specular, "Implementation")."""
    root = (values["ior"] - 1.0) / (values["ior"] + 1.0)
    red, green, blue = (
        of_numbers("minimum", root * root * color, 1.0) for color in values["specularColorFactor"]
    )
    return red, green, blue


def _base(values: Values, h: Components, wi: Components, wo: Components) -> Components:
    """The mixture of dielectric and metal below sheen and coat."""
    xp = namespace(*h)
    weight, color = values["specularFactor"], values["baseColorFactor"]
    red, green, blue = (weight * f for f in dielectric_reflectance(values))
    normal = red, green, blue
    grazing = schlick(dot(wo, h), (0.0, 0.0, 0.0))[0]
    thickness = values["iridescenceThicknessMaximum"]
    film = Film.seen(values["iridescenceIor"], thickness, wo[2])
    part = values["iridescenceFactor"] * of_numbers("minimum", thickness / _THINNEST, 1.0)

    film_d, film_m = film.reflectance(normal), film.reflectance(color)
    highest = xp.maximum(xp.maximum(film_d[0], film_d[1]), film_d[2])
    facets = ggx_facets(wi, wo, h, _alphas(values))
    metallic = values["metallicFactor"]

    def channel(k: int) -> Array:
        plain = normal[k] + (weight - normal[k]) * grazing
        below = 1.0 - plain - part * (highest - plain)
        dielectric = plain + part * (film_d[k] - plain)
        plain = color[k] + (1.0 - color[k]) * grazing
        metal = plain + part * (film_m[k] - plain)
        specular = facets * (dielectric + metallic * (metal - dielectric))
        return specular + (1.0 - metallic) * below * (color[k] / math.pi)

    return channel(0), channel(1), channel(2)


def _velvet(
    values: Values, base: Components, h: Components, wi: Components, wo: Components
) -> Components:
    """Sheen over the base, which gets the remaining light."""
    color, roughness = values["sheenColorFactor"], values["sheenRoughnessFactor"]
    fibers = charlie(h, wi, wo, roughness * roughness)
    taken = charlie_albedo(namespace(*wi, *wo).minimum(wi[2], wo[2]), roughness)
    left = 1.0 - of_numbers("minimum", largest(color), 1.0) * taken
    red, green, blue = (c * fibers + left * f for c, f in zip(color, base, strict=True))
    return red, green, blue


def _alpha(roughness: Array) -> Array:
    return of_numbers("maximum", roughness * roughness, MIN_ROUGHNESS)


def _alphas(values: Values) -> tuple[Array, Array]:
    """Roughness of the base along and across its axis."""
    alpha = _alpha(values["roughnessFactor"])
    if "anisotropyStrength" not in values:
        return alpha, alpha
    strength = values["anisotropyStrength"]
    return alpha + (1.0 - alpha) * strength * strength, alpha
