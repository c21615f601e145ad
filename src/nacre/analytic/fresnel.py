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
