"""Rough diffuse reflection that conserves energy.

This is Oren and Nayar's model as improved by Fujii, with light that facets scatter again
(Portsmouth, Kutz and Hill 2024, "EON: A Practical Energy-Preserving Rough Diffuse BRDF", equations
12 and 14). Renderers depart from the paper in different ways. Colors are the scatterers' albedo, in
[0, 1], and so is the roughness; 0 is Lambert's model.
"""

from __future__ import annotations

import math

from nacre.array import Array, Components, namespace
from nacre.geometry import dot

_SINGLE = 0.5 - 2.0 / (3.0 * math.pi)
_MEAN = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)


def eon(color: Components, roughness: Array, wi: Components, wo: Components) -> Components:
    """f_r in 1/sr as in MaterialX (`mx_oren_nayar_diffuse_bsdf`), which clamps wi.wo at 0."""
    cosine = namespace(*wi, *wo).maximum(dot(wi, wo), 0.0)
    return _reflected(color, color, roughness, cosine, wi, wo)


def rough_diffuse(
    color: Components, roughness: Array, wi: Components, wo: Components
) -> Components:
    """f_r in 1/sr as in Cycles (closure/bsdf_oren_nayar.h).

    Light that facets scatter again is multiplied by the color once more.
    """
    red, green, blue = (c * c for c in color)
    return _reflected(color, (red, green, blue), roughness, dot(wi, wo), wi, wo)


def _reflected(
    color: Components,
    again: Components,
    roughness: Array,
    cosine: Array,
    wi: Components,
    wo: Components,
) -> Components:
    """f_r in 1/sr; light that facets scatter again is also colored by `again`."""
    xp = namespace(*wi, *wo)
    s = cosine - wi[2] * wo[2]
    ratio = s / xp.where(s > 0.0, xp.maximum(wi[2], wo[2]), 1.0)
    scale = 1.0 / (1.0 + _SINGLE * roughness)
    once = scale * (1.0 + roughness * ratio)
    lost = scale * roughness * _loss(wi[2]) * _loss(wo[2]) * (1.0 / (_SINGLE - _MEAN))
    mean = scale * (1.0 + _MEAN * roughness)
    red, green, blue = (
        c * (once + tint * mean / (1.0 - c * (1.0 - mean)) * lost) * (1.0 / math.pi)
        for c, tint in zip(color, again, strict=True)
    )
    return red, green, blue


def _loss(cosine: Array) -> Array:
    """The loss of albedo under single scattering, over roughness times scale."""
    xp = namespace(cosine)
    sine = xp.sqrt(xp.maximum(1.0 - cosine * cosine, 1e-12))
    angle = xp.arctan2(sine, cosine)
    g = sine * (angle - 2.0 / 3.0 - sine * cosine)
    # sin (1 - sin^3) / cos without cancellation at small cosines
    g = g + (2.0 / 3.0) * sine * cosine * (1.0 + sine + sine * sine) / (1.0 + sine)
    return _SINGLE - g * (1.0 / math.pi)
