"""The reflection of OpenPBR Surface 1.1.

The specification (Academy Software Foundation, "OpenPBR Surface", version 1.1) describes slabs and
leaves their evaluation to renderers. This module follows MaterialX 1.39.5 under lights without
extent (libraries/bxdf/open_pbr_surface.mtlx and libraries/pbrlib/genglsl), because that is what
viewers show: microfacets with albedo fits and compensation, and a layer over another as
(1 - albedo of the upper) times the lower. It also follows it where it departs from the
specification:

- `base_weight` multiplies EON's result, not its color;
- masking has one roughness, the geometric mean of both;
- a coat's absorption is the same in all directions;
- a film on a metal reflects half of what the metal does on its lower side, and its color channels
  are taken as x, y and z.

The only difference is for metals that `specular_color` makes dark at 82 degrees: their reflectance
is at least 0 here and can be negative in MaterialX. Transmission, subsurface scattering and
emission are at their defaults, which is none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, Literal

from nacre.analytic.fresnel import dielectric
from nacre.analytic.ggx import masking_divisor
from nacre.analytic.model import AnalyticBrdf, Parameter, Values
from nacre.array import Array, Components, namespace
from nacre.geometry import dot, half_vector, rotate
from nacre.sampling.visible_normals import MIN_ROUGHNESS, distribution
from nacre.standard.metal_fresnel import metal, metal_at_82, metal_dip
from nacre.standard.parameter_math import GRAZING, bounded, color_parameter, fraction, of_numbers
from nacre.standard.rough_diffuse import eon
from nacre.standard.sheen_ltc import MIN_FITTED_ROUGHNESS, fitted_sheen
from nacre.standard.thin_film import (
    amplitudes,
    dielectric_series,
    fringes,
    mean,
    reflectance,
    refracted,
    series,
)


def _index(name: str) -> Parameter:
    return Parameter(name, 1.0, 3.0, (1.3, 1.8), allowed=(1.0, 100.0))


_COAT_ANISOTROPY = fraction("coat_roughness_anisotropy", (0.1, 0.8))
_SPECULAR_ANISOTROPY = fraction("specular_roughness_anisotropy", (0.1, 0.8))
ANGLE = Parameter("angle", -0.5 * math.pi, 0.5 * math.pi, (-0.4 * math.pi, 0.4 * math.pi))


class OpenPbr(AnalyticBrdf):
    """OpenPBR Surface with equal roughness along all tangents.

    Parameters have the specification's names and suggested ranges, beyond which colors, indices
    and the film's thickness, in micrometers, may go. Roughnesses below 0.03 act like 0.03, where
    float32 directions still resolve the lobe.
    """

    model = "openpbr"
    by_design: ClassVar = {
        "reciprocity": "a layer dims those below by its albedo toward the viewer, as in MaterialX"
    }
    fitted_on: ClassVar[Literal["samples", "pictures"]] = "pictures"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        fraction("base_weight", (1.0, 1.0)),
        color_parameter("base_color"),
        fraction("base_diffuse_roughness", (0.0, 1.0)),
        fraction("base_metalness", (0.0, 1.0)),
        fraction("specular_weight", (0.0, 1.0)),
        color_parameter("specular_color", (0.5, 0.98)),
        fraction("specular_roughness", (0.1, 0.8)),
        _index("specular_ior"),
        fraction("coat_weight", (0.0, 1.0)),
        color_parameter("coat_color", (0.5, 0.98)),
        fraction("coat_roughness", (0.05, 0.5)),
        _index("coat_ior"),
        fraction("coat_darkening", (1.0, 1.0)),
        fraction("fuzz_weight", (0.0, 0.6)),
        color_parameter("fuzz_color"),
        fraction("fuzz_roughness", (0.2, 0.9)),
        fraction("thin_film_weight", (0.02, 0.9)),
        Parameter("thin_film_thickness", 0.0, 1.0, (0.1, 0.8), allowed=(0.0, 100.0)),
        _index("thin_film_ior"),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        if "angle" in values:
            wi, wo = rotate(wi, -1.0 * values["angle"]), rotate(wo, -1.0 * values["angle"])
        wi, wo = ((w[0], w[1], xp.maximum(w[2], GRAZING)) for w in (wi, wo))
        h = half_vector(wi, wo)
        cosine = xp.minimum(dot(wi, h), 1.0)

        base = _base(values, wi, wo, h, cosine)
        coat, under_coat = _coat(values, wi, wo, h, cosine)
        roughness = bounded(values["fuzz_roughness"], MIN_FITTED_ROUGHNESS, 1.0)
        fibers, albedo = fitted_sheen(wi, wo, roughness)
        fuzz = values["fuzz_weight"] * fibers
        under_fuzz = 1.0 - values["fuzz_weight"] * albedo
        red, green, blue = (
            fuzz * color + under_fuzz * (coat + under * below)
            for color, under, below in zip(values["fuzz_color"], under_coat, base, strict=True)
        )
        return red, green, blue


class AnisotropicOpenPbr(OpenPbr):
    """OpenPBR Surface with roughness stretched along a tangent.

    `angle` (radians) rotates the tangent from +x toward +y; in files it is `geometry_tangent` and
    `geometry_coat_tangent`.
    """

    model = "openpbr-anisotropic"
    isotropic = False
    parameters = (*OpenPbr.parameters, _SPECULAR_ANISOTROPY, _COAT_ANISOTROPY, ANGLE)


_ALBEDO_FIT = (
    (0.1003, (-0.6303, 9.748, -2.038, 29.34, -8.245, -26.44, 19.99, -5.448)),
    (0.9345, (-2.323, 2.229, -3.748, 1.424, -0.7684, 1.436, 0.2913, 0.6286)),
    (1.0, (-1.765, 8.263, 11.53, 28.96, -7.507, -36.11, 15.86, 33.37)),
    (1.0, (0.2281, 15.94, -55.83, 13.08, 41.26, 54.9, 300.2, -285.1)),
)
"""Numerators of A and B, then denominators: the constant, and factors of x, y, xy, x^2, y^2, x^2 y,
x y^2 and x^2 y^2."""


def _ggx_albedo(cosine: Array, alpha: Array) -> tuple[Array, Array]:
    """Albedos A and B of GGX under Schlick's reflectance: F0 A + F90 B, both in [0, 1].

    `alpha` is the roughness. The rational fit of MaterialX (libraries/pbrlib/genglsl/lib/
    mx_microfacet_specular.glsl, `mx_ggx_dir_albedo_analytic`).
    """
    xp = namespace(cosine, alpha)
    x, y = cosine, alpha
    xx, yy, xy = x * x, y * y, x * y
    terms = (x, y, xy, xx, yy, xx * y, x * yy, xx * yy)
    tops_and_bottoms = [
        constant + sum(factor * term for factor, term in zip(factors, terms, strict=True))
        for constant, factors in _ALBEDO_FIT
    ]
    top_a, top_b, bottom_a, bottom_b = tops_and_bottoms
    a, b = (
        xp.minimum(xp.maximum(top / bottom, 0.0), 1.0)
        for top, bottom in ((top_a, bottom_a), (top_b, bottom_b))
    )
    return a, b


def _chosen(condition: Any, yes: Array, no: Array) -> Array:
    """One parameter if a condition on parameters holds, otherwise the other."""
    if isinstance(condition, bool):
        return yes if condition else no
    return namespace(condition).where(condition, yes, no)


def _mix(below: Array, above: Array, weight: Array) -> Array:
    return below + weight * (above - below)


class _Facets:
    """GGX facets with one roughness, shared by lobes with different reflectances.

    Roughness and anisotropy are as in OpenPBR's section "Microfacet model"; the directions are wi,
    wo and their half vector. Light that is scattered again follows Turquin 2019, "Practical
    multiple scattering compensation for microfacet models", equations 14 and 16.
    """

    def __init__(
        self,
        roughness: Array,
        anisotropy: Array | None,
        directions: tuple[Components, Components, Components],
    ) -> None:
        wi, wo, h = directions
        square = roughness * roughness
        if anisotropy is None:
            alpha = bounded(square, MIN_ROUGHNESS, 1.0)
            axes = alpha, alpha
        else:
            across = 1.0 - anisotropy
            along = square * of_numbers("sqrt", 2.0 / (1.0 + across * across))
            axes = (
                bounded(along, MIN_ROUGHNESS, 1.0),
                bounded(along * across, MIN_ROUGHNESS, 1.0),
            )
            alpha = of_numbers("sqrt", axes[0] * axes[1])
        self.lobe = distribution(h, axes) / masking_divisor(wi, wo, (alpha, alpha))
        """f_r in 1/sr where all is reflected, once."""
        self.normal, self.grazing = _ggx_albedo(wo[2], alpha)
        albedo = self.normal + self.grazing
        self.again = (1.0 - albedo) / albedo

    def compensated(self, reflectance: Array) -> Array:
        """The lobe's factor for a Fresnel reflectance, with light that is scattered again."""
        return reflectance * (1.0 + reflectance * self.again)

    def passed(self, normal: Array, reflectance: Array) -> Array:
        """The light that passes through a layer, given its reflectance at normal incidence."""
        return 1.0 - (normal * self.normal + self.grazing) * (1.0 + reflectance * self.again)


def _coat(
    values: Values, wi: Components, wo: Components, h: Components, cosine: Array
) -> tuple[Array, Components]:
    """Reflection by a coat, in 1/sr, and factors for the layers below it."""
    weight, index = values["coat_weight"], values["coat_ior"]
    facets = _Facets(values["coat_roughness"], values.get("coat_roughness_anisotropy"), (wi, wo, h))
    fresnel = dielectric(cosine, index)
    root = (index - 1.0) / (index + 1.0)
    normal = root * root
    passed = 1.0 - weight * (1.0 - facets.passed(normal, fresnel))
    # Light that the coat reflects back to the base is absorbed there once more.
    out = (1.0 - normal) / (index * index)
    kept = _mix(1.0, values["specular_weight"], values["base_metalness"])
    darkening = weight * values["coat_darkening"]
    red, green, blue = (
        passed
        * _mix(1.0, tint, weight)
        * _mix(1.0, out / (1.0 - bounded(color * kept, 0.0, 1.0) * (1.0 - out)), darkening)
        for color, tint in zip(values["base_color"], values["coat_color"], strict=True)
    )
    return weight * facets.compensated(fresnel) * facets.lobe, (red, green, blue)


def _base(
    values: Values, wi: Components, wo: Components, h: Components, cosine: Array
) -> Components:
    """f_r in 1/sr of metal, and of a dielectric over a diffuse base."""
    coat = values["coat_weight"]
    own, rough = values["specular_roughness"] ** 4, values["coat_roughness"] ** 4
    widened = of_numbers("sqrt", of_numbers("sqrt", bounded(own + 2.0 * rough, 1e-12, 1.0)))
    facets = _Facets(
        _mix(values["specular_roughness"], widened, coat),
        values.get("specular_roughness_anisotropy"),
        (wi, wo, h),
    )
    film = _Film(values, cosine)

    # Below a coat the index is relative to it, inverted where light would be totally reflected.
    ratio = values["specular_ior"] / values["coat_ior"]
    index = _mix(values["specular_ior"], of_numbers("maximum", ratio, 1.0 / ratio), coat)
    root = (
        of_numbers("sqrt", bounded(values["specular_weight"], 1e-12, 1.0))
        * (index - 1.0)
        / (index + 1.0)
    )
    index = (1.0 + root) / (1.0 - root)
    clear, filmed = dielectric(cosine, index), film.on_dielectric(index)
    diffuse = eon(values["base_color"], values["base_diffuse_roughness"], wi, wo)

    edge = values["specular_color"]
    normal = tuple(values["base_weight"] * color for color in values["base_color"])
    dips = [metal_dip(n, e * metal_at_82(n)) for n, e in zip(normal, edge, strict=True)]
    bare = [metal(cosine, n, dip) for n, dip in zip(normal, dips, strict=True)]
    covered = film.on_metal(normal, dips)

    found: list[Array] = []
    for k in range(3):
        gloss = _mix(facets.compensated(clear), facets.compensated(filmed[k]), film.weight)
        shine = _mix(facets.compensated(bare[k]), facets.compensated(covered[k]), film.weight)
        passed = facets.passed(root * root, _mix(clear, filmed[k], film.weight))
        plastic = edge[k] * gloss * facets.lobe + values["base_weight"] * diffuse[k] * passed
        metallic = values["specular_weight"] * shine * facets.lobe
        found.append(_mix(plastic, metallic, values["base_metalness"]))
    return found[0], found[1], found[2]


class _Film:
    """A thin film on facets, at a cosine between the light and their normals."""

    def __init__(self, values: Values, cosine: Array) -> None:
        thickness, self.index = values["thin_film_thickness"], values["thin_film_ior"]
        self.weight = _chosen(thickness > 0.0, values["thin_film_weight"], 0.0)
        self.outside, self.inside = cosine, refracted(cosine, self.index)
        self.fringes = fringes(2.0 * thickness * self.index * self.inside)

    def on_dielectric(self, index: Array) -> Components:
        """Reflectance over a medium with a refractive index."""
        weights = dielectric_series(self.outside, self.inside, self.index, index)
        return reflectance([weights] * 3, self.fringes)

    def on_metal(self, normal: Sequence[Array], dips: Sequence[Array]) -> Components:
        """Reflectance over a metal; see :mod:`nacre.standard.metal_fresnel`."""
        xp = namespace(self.inside)
        outer = amplitudes(self.outside, self.inside, self.index)
        mirrored = (self.index - 1.0) / (self.index + 1.0)
        found = []
        for n, dip in zip(normal, dips, strict=True):
            inner = 0.5 * metal(self.inside, n, dip)
            denser = bounded(n, 0.01, 0.99) >= mirrored * mirrored
            root = _chosen(denser, -1.0, 1.0) * xp.sqrt(inner)
            p, s = (series(a * a, inner, a * root) for a in outer)
            found.append(mean(p, s))
        return reflectance(found, self.fringes)
