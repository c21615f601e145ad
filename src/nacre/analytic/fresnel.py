"""Fresnel reflectance."""

from __future__ import annotations

from nacre.array import Array, Components, namespace


def schlick(cosine: Array, normal: tuple[Array, Array, Array]) -> Components:
    """Schlick's approximation (1994): F0 + (1 - F0) (1 - cos)^5 a channel.

    Parameters
    ----------
    cosine
        Between the microfacet's normal and either direction.
    normal
        F0 of each channel.
    """
    xp = namespace(cosine)
    grazing = xp.maximum(1.0 - cosine, 0.0)
    square = grazing * grazing
    fifth = square * square * grazing
    red, green, blue = (f + (1.0 - f) * fifth for f in normal)
    return red, green, blue


def schlick_one(cosine: Array, normal: Array) -> Array:
    """:func:`schlick` of one F0 for all channels."""
    return schlick(cosine, (normal, normal, normal))[0]


def dielectric(cosine: Array, index: Array) -> Array:
    """Unpolarized reflectance of a dielectric surface (Cook and Torrance 1982, section "Spectral
    Composition").

    Parameters
    ----------
    cosine
        As in :func:`schlick`.
    index
        Refractive index relative to the outside, at least 1.
    """
    xp = namespace(cosine)
    g = xp.sqrt(xp.maximum(index * index - 1.0 + cosine * cosine, 1e-12))
    parallel = (g - cosine) / (g + cosine)
    ratio = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0)
    return 0.5 * parallel * parallel * (1.0 + ratio * ratio)
