"""Rough diffuse reflection as Cycles has it."""

from __future__ import annotations

import math

from nacre.array import Array, Components, namespace
from nacre.geometry import dot

_SINGLE = 0.5 - 2.0 / (3.0 * math.pi)
_MEAN = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)


def rough_diffuse(
    wi: Components, wo: Components, roughness: Array, color: Components
) -> Components:
    """f_r in 1/sr of the Oren-Nayar closure of Cycles (closure/bsdf_oren_nayar.h).

    Fujii's model with what facets scatter again (Portsmouth, Kutz and Hill 2024, "EON: A Practical
    Energy-Preserving Rough Diffuse BRDF", equations 12 and 14); that part has the color once more.

    Parameters
    ----------
    roughness
        In [0, 1]; 0 is Lambert's.
    color
        Albedo of what scatters, in [0, 1].
    """
    xp = namespace(*wi, *wo)
    s = dot(wi, wo) - wi[2] * wo[2]
    ratio = s / xp.where(s > 0.0, xp.maximum(wi[2], wo[2]), 1.0)
    scale = 1.0 / (1.0 + _SINGLE * roughness)
    once = scale * (1.0 + roughness * ratio)
    again = scale * roughness * _loss(wi[2]) * _loss(wo[2]) * (1.0 / (_SINGLE - _MEAN))
    mean = scale * (1.0 + _MEAN * roughness)
    red, green, blue = (
        c * (once + c * c * mean / (1.0 - c * (1.0 - mean)) * again) * (1.0 / math.pi)
        for c in color
    )
    return red, green, blue


def _loss(cosine: Array) -> Array:
    """What single scattering loses of its albedo in a direction, over roughness times scale."""
    xp = namespace(cosine)
    sine = xp.sqrt(xp.maximum(1.0 - cosine * cosine, 1e-12))
    angle = xp.arctan2(sine, cosine)
    g = sine * (angle - 2.0 / 3.0 - sine * cosine)
    # sin (1 - sin^3) / cos without the difference that vanishes with the cosine
    g = g + (2.0 / 3.0) * sine * cosine * (1.0 + sine + sine * sine) / (1.0 + sine)
    return _SINGLE - g * (1.0 / math.pi)
