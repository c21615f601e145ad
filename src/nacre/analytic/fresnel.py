"""Fresnel reflectance."""

from __future__ import annotations

from nacre.analytic.model import INDEX, NORMAL_REFLECTANCE, Values
from nacre.array import Array, Components, namespace


def schlick(cosine: Array, normal: tuple[Array, Array, Array]) -> Components:
    """Schlick's approximation (1994): F0 + (1 - F0) (1 - cos)^5 per channel.

    `cosine` is between the microfacet's normal and either direction, `normal` is F0.
    """
    xp = namespace(cosine)
    grazing = xp.maximum(1.0 - cosine, 0.0)
    square = grazing * grazing
    fifth = square * square * grazing
    red, green, blue = (f + (1.0 - f) * fifth for f in normal)
    return red, green, blue


def fresnel(values: Values, cosine: Array) -> Array:
    """The term of a model that has `index`, or one `normal_reflectance` for all channels."""
    if INDEX.name in values:
        return dielectric(cosine, values[INDEX.name])
    return schlick(cosine, (values[NORMAL_REFLECTANCE.name],) * 3)[0]


def dielectric(cosine: Array, index: Array) -> Array:
    """Unpolarized reflectance of a dielectric surface whose refractive index relative to the
    outside is at least 1 (Cook and Torrance 1982, section "Spectral Composition").
    """
    xp = namespace(cosine)
    g = xp.sqrt(xp.maximum(index * index - 1.0 + cosine * cosine, 1e-12))
    parallel = (g - cosine) / (g + cosine)
    ratio = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0)
    return 0.5 * parallel * parallel * (1.0 + ratio * ratio)
