"""The reflection of Blender's Principled BSDF, as Cycles evaluates it.

From the top: sheen, a coat, and a mixture of metal with dielectric facets over a diffuse base. Each
layer dims those below it according to its albedo toward the viewer, so exchanging light and viewer
changes the value. Facets are GGX with the node's default distribution, Multiscatter GGX: lobes are
scaled up to all light that facets scatter (Kulla and Conty 2017, "Revisiting Physically Based
Shading at Imageworks"). Transmission, subsurface scattering and emission are left out.

Source: Blender 5.0, intern/cycles/kernel/svm/closure.h with closure/bsdf_microfacet.h, bsdf_util.h,
bsdf_sheen.h and bsdf_oren_nayar.h.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import ClassVar, Literal

from nacre.analytic.fresnel import dielectric
from nacre.analytic.ggx import ggx_facets
from nacre.analytic.model import AnalyticBrdf, Parameter, Values
from nacre.array import Array, Components, namespace
from nacre.geometry import dot, half_vector, rotate
from nacre.sampling.visible_normals import MIN_ROUGHNESS
from nacre.standard.cycles_film import Film
from nacre.standard.facet_albedo import albedo_table, fresnel_table, mean_albedo_table
from nacre.standard.lookup import interpolate
from nacre.standard.metal_fresnel import mean_metal, metal, metal_at_82, metal_dip
from nacre.standard.parameter_math import GRAZING, color_parameter, fraction, largest, of_numbers
from nacre.standard.rough_diffuse import rough_diffuse
from nacre.standard.sheen_ltc import ltc_sheen

_BRIGHTEST = 0.99  # highest reflectance at normal incidence that gets an index


def _index(name: str) -> Parameter:
    return Parameter(name, 1.0, 4.0, (1.3, 1.8))


class Principled(AnalyticBrdf):
    """The Principled BSDF without anisotropy.

    Parameters are the node's inputs, in the ranges of their sliders; indices end at 4, as for the
    coat. Roughnesses below 0.032 act like 0.032, where float32 directions still resolve the lobe.
    """

    model = "principled"
    by_design: ClassVar = {
        "reciprocity": "a layer dims those below by its albedo toward the viewer, as in Blender"
    }
    fitted_on: ClassVar[Literal["samples", "pictures"]] = "pictures"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        color_parameter("base_color"),
        fraction("metallic"),
        fraction("roughness", (0.1, 0.8)),
        _index("ior"),
        fraction("specular_ior_level", (0.3, 0.7)),
        color_parameter("specular_tint", (0.5, 1.0)),
        fraction("diffuse_roughness"),
        fraction("coat_weight"),
        fraction("coat_roughness", (0.05, 0.5)),
        _index("coat_ior"),
        color_parameter("coat_tint", (0.6, 1.0)),
        fraction("sheen_weight", (0.02, 0.5)),
        fraction("sheen_roughness", (0.2, 0.9)),
        color_parameter("sheen_tint", (0.5, 1.0)),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        if "anisotropic" in values:
            angle = (-2.0 * math.pi) * values["anisotropic_rotation"]
            wi, wo = rotate(wi, angle), rotate(wo, angle)
        wi, wo = ((w[0], w[1], xp.maximum(w[2], GRAZING)) for w in (wi, wo))
        layers = _Layers(wi, wo)
        layers.sheen(values)
        layers.coat(values)
        layers.base(values)
        red, green, blue = layers.total
        return red, green, blue


class AnisotropicPrincipled(Principled):
    """The Principled BSDF with `anisotropic` and `anisotropic_rotation`.

    The rotation is in turns of the tangent from +x toward +y.
    """

    model = "principled-anisotropic"
    isotropic = False
    parameters = (
        *Principled.parameters,
        fraction("anisotropic", (0.1, 0.8)),
        fraction("anisotropic_rotation"),
    )


_FILM = (Parameter("thin_film_thickness", 1.0, 2000.0, (100.0, 800.0)), _index("thin_film_ior"))


class FilmPrincipled(Principled):
    """The Principled BSDF with a thin film, whose thickness is in nanometers."""

    model = "principled-film"
    parameters = (*Principled.parameters, *_FILM)


class AnisotropicFilmPrincipled(AnisotropicPrincipled):
    """The Principled BSDF with anisotropy and a thin film."""

    model = "principled-film-anisotropic"
    parameters = (*AnisotropicPrincipled.parameters, *_FILM)


class _Layers:
    """The sum of what layers reflect, from the top down, and the light that they leave."""

    def __init__(self, wi: Components, wo: Components) -> None:
        self.wi, self.wo, self.h = wi, wo, half_vector(wi, wo)
        self._xp = namespace(*wi, *wo)
        self._cosine = self._xp.minimum(dot(wi, self.h), 1.0)
        self._left: list[Array] = [1.0, 1.0, 1.0]
        self.total: list[Array] = [0.0, 0.0, 0.0]

    def sheen(self, values: Values) -> None:
        """Fibers on top of everything."""
        lobe, albedo = ltc_sheen(self.wi, self.wo, values["sheen_roughness"])
        weights = [values["sheen_weight"] * tint for tint in values["sheen_tint"]]
        self._add(weight * lobe for weight in weights)
        self._cover([weight * albedo for weight in weights])

    def coat(self, values: Values) -> None:
        """A dielectric; its tint colors the light from below by the length of the view's path."""
        weight, index, roughness = (values[f"coat_{k}"] for k in ("weight", "ior", "roughness"))
        facets = _Facets(self.wi, self.wo, self.h, (roughness * roughness,) * 2)
        again = weight * facets.again(_mean_reflectance(index))
        self._add([again * facets.lobe * dielectric(self._cosine, index)] * 3)
        normal = _at_normal(index)
        rise = facets.mean_rise(index)
        self._cover([again * facets.albedo * (normal + (1.0 - normal) * rise)] * 3)
        z = self.wo[2]
        inside = self._xp.sqrt(self._xp.maximum(1.0 - (1.0 - z * z) / (index * index), 1e-6))
        for k, tint in enumerate(values["coat_tint"]):
            log = of_numbers("log", of_numbers("maximum", tint, 1e-6))
            self._left[k] *= 1.0 - weight + weight * self._xp.exp(log / inside)

    def base(self, values: Values) -> None:
        """Metal, or dielectric facets over a diffuse base; a film covers both."""
        color, tints = values["base_color"], values["specular_tint"]
        facets = _Facets(self.wi, self.wo, self.h, _axes(values))
        film = _film(values, self._cosine)
        self._add(facets.lobe * amount for amount in self._metal(values, facets, film))
        self._left = [left * (1.0 - values["metallic"]) for left in self._left]

        # The level scales the reflectance at normal incidence, and the index goes with it.
        level = 2.0 * values["specular_ior_level"] * _at_normal(values["ior"])
        root = of_numbers("sqrt", of_numbers("minimum", level, _BRIGHTEST))
        index = (1.0 + root) / (1.0 - root)
        normal = root * root
        span = 1.0 / (1.0 - normal)
        mean = of_numbers("maximum", (_mean_reflectance(index) - normal) * span, 0.0)
        first = [of_numbers("minimum", level * tint, 1.0) for tint in tints]
        again = [facets.again(f + (1.0 - f) * mean) for f in first]
        if film is None:
            # For high indices it is lowest at Brewster's angle.
            rise = self._xp.maximum((dielectric(self._cosine, index) - normal) * span, 0.0)
            rises = self._xp.minimum(rise, 1.0), facets.mean_rise(index)
            once, seen = ([f + (1.0 - f) * r for f in first] for r in rises)
        else:
            films = film, _film(values, self.wo[2])
            once, seen = (
                _scaled(f.on_dielectric(index), first, normal) for f in films if f is not None
            )
        self._add(a * facets.lobe * f for a, f in zip(again, once, strict=True))
        self._cover([a * facets.albedo * f for a, f in zip(again, seen, strict=True)])
        self._add(rough_diffuse(color, values["diffuse_roughness"], self.wi, self.wo))

    def _metal(self, values: Values, facets: _Facets, film: Film | None) -> Iterable[Array]:
        """Factors for the facets' lobe, one per channel."""
        for k, (normal, tint) in enumerate(
            zip(values["base_color"], values["specular_tint"], strict=True)
        ):
            at_82 = metal_at_82(normal) * tint
            dip = metal_dip(normal, at_82)
            if film is None:
                once = metal(self._cosine, normal, dip)
            else:
                once = film.on_metal(k, normal, at_82)
            yield values["metallic"] * once * facets.again(mean_metal(normal, dip))

    def _add(self, reflected: Iterable[Array]) -> None:
        """Add a layer's f_r, one value per channel, for the light that is left."""
        self.total = [
            total + left * f_r
            for total, left, f_r in zip(self.total, self._left, reflected, strict=True)
        ]

    def _cover(self, albedo: list[Array]) -> None:
        """Leave what a layer does not reflect in the channel that it reflects most."""
        fraction = self._xp.maximum(1.0 - largest(tuple(albedo)), 0.0)
        self._left = [left * fraction for left in self._left]


class _Facets:
    """GGX facets that reflect everything.

    `lobe` is f_r in 1/sr for light that is scattered once; `albedo` is that of the lobe toward the
    viewer.
    """

    def __init__(
        self, wi: Components, wo: Components, h: Components, alpha: tuple[Array, Array]
    ) -> None:
        alpha_x, alpha_y = (
            of_numbers("minimum", of_numbers("maximum", a, MIN_ROUGHNESS), 1.0) for a in alpha
        )
        self._roughness = of_numbers("sqrt", of_numbers("sqrt", alpha_x * alpha_y))
        self._cosine = wo[2]
        self.lobe = ggx_facets(wi, wo, h, (alpha_x, alpha_y))
        self.albedo = interpolate(albedo_table(), self._roughness, self._cosine)
        self._mean = interpolate(mean_albedo_table(), self._roughness)
        self._missing = (1.0 - self.albedo) / self.albedo

    def again(self, reflectance: Array) -> Array:
        """Factor on the lobe for repeated scattering with a mean reflectance.

        Kulla and Conty 2017, slide 16.
        """
        many = reflectance * self._mean / (1.0 - reflectance * (1.0 - self._mean))
        return 1.0 + many * self._missing

    def mean_rise(self, index: Array) -> Array:
        """Where a dielectric's reflectance for the viewer lies between that at normal incidence and
        1.
        """
        place = of_numbers("sqrt", (index - 1.0) / (index + 1.0))
        return interpolate(fresnel_table(), self._roughness, self._cosine, place)


def _axes(values: Values) -> tuple[Array, Array]:
    """Roughness alpha along and across the tangent."""
    alpha = values["roughness"] * values["roughness"]
    if "anisotropic" not in values:
        return alpha, alpha
    aspect = of_numbers("sqrt", 1.0 - 0.9 * values["anisotropic"])
    return alpha / aspect, alpha * aspect


def _film(values: Values, cosine: Array) -> Film | None:
    """The film under light at an angle; None in models without one."""
    if "thin_film_thickness" not in values:
        return None
    return Film(values["thin_film_thickness"], values["thin_film_ior"], cosine)


def _scaled(reflectance: Components, first: list[Array], normal: Array) -> list[Array]:
    """Reflectance of a film over a base whose reflectance at normal incidence does not fit its
    index.

    It is scaled by the ratio of both, the less the closer it is to 1.
    """
    scaled = []
    for value, wanted in zip(reflectance, first, strict=True):
        xp = namespace(value)
        dark = xp.minimum((1.0 - value) / (1.0 - normal), 1.0)
        ratio = wanted / of_numbers("maximum", normal, 1e-6)
        found = value * (1.0 + (ratio - 1.0) * dark)
        scaled.append(xp.where(normal + 0.0 * value > 1e-5, found, value))
    return scaled


def _at_normal(index: Array) -> Array:
    """Reflectance of a dielectric at normal incidence."""
    root = (index - 1.0) / (index + 1.0)
    return root * root


def _mean_reflectance(index: Array) -> Array:
    """Cosine-weighted mean reflectance of a dielectric (Kulla and Conty 2017)."""
    return (index - 1.0) / (4.08567 + 1.00071 * index)
