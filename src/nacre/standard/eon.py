"""Rough diffuse reflection that keeps energy: Oren and Nayar's model as improved by Fujii."""

from __future__ import annotations

import math

from nacre.array import Array, Components, namespace
from nacre.geometry import dot

_SINGLE = 0.5 - 2.0 / (3.0 * math.pi)
_MEAN = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)


def eon(color: Components, roughness: Array, wi: Components, wo: Components) -> Components:
    """f_r in 1/sr of EON (Portsmouth, Kutz and Hill 2024, "EON: A Practical Energy-Preserving Rough
    Diffuse BRDF", equations 12 and 14), as MaterialX evaluates it.

    The cosine between the directions is at least 0, which the paper's is not: MaterialX has it so
    (`mx_oren_nayar_diffuse_bsdf`).

    Parameters
    ----------
    color
        Albedo of what scatters, in [0, 1].
    roughness
        In [0, 1]; 0 is Lambert's.
    """
    xp = namespace(*wi, *wo)
    s = xp.maximum(dot(wi, wo), 0.0) - wi[2] * wo[2]
    ratio = s / xp.where(s > 0.0, xp.maximum(wi[2], wo[2]), 1.0)
    scale = 1.0 / (1.0 + _SINGLE * roughness)
    once = scale * (1.0 + roughness * ratio)
    lost = scale * roughness * _loss(wi[2]) * _loss(wo[2]) * (1.0 / (_SINGLE - _MEAN))
    mean = scale * (1.0 + _MEAN * roughness)
    red, green, blue = (
        c * (once + c * mean / (1.0 - c * (1.0 - mean)) * lost) * (1.0 / math.pi) for c in color
    )
    return red, green, blue


def _loss(cosine: Array) -> Array:
    """What single scattering loses of its albedo in a direction, over roughness times scale."""
    xp = namespace(cosine)
    sine = xp.sqrt(xp.maximum(1.0 - cosine * cosine, 1e-12))
    g = sine * (xp.arctan2(sine, cosine) - sine * cosine) + (2.0 / 3.0) * sine * (
        cosine * (1.0 + sine + sine * sine) / (1.0 + sine) - 1.0
    )
    return _SINGLE - g * (1.0 / math.pi)
