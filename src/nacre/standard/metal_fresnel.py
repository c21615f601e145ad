"""Reflectance of metals with a dip near grazing angles.

Kutz, Hasan and Edmondson 2021, "Novel aspects of the Adobe Standard Material": Schlick's
approximation minus a term that is largest at 82 degrees.
"""

from __future__ import annotations

from nacre.analytic.fresnel import schlick
from nacre.array import Array, namespace

_COSINE = 1.0 / 7.0  # of 82 degrees
_RISE = (1.0 - _COSINE) ** 5
_SCALE = 1.0 / (_COSINE * (1.0 - _COSINE) ** 6)


def metal_at_82(normal: Array) -> Array:
    """Schlick's reflectance at 82 degrees, from that at normal incidence."""
    return normal + (1.0 - normal) * _RISE


def metal_dip(normal: Array, at_82: Array) -> Array:
    """Size of the term that lowers the reflectance at 82 degrees to a value."""
    return (metal_at_82(normal) - at_82) * _SCALE


def metal(cosine: Array, normal: Array, dip: Array) -> Array:
    """Reflectance, in [0, 1]."""
    xp = namespace(cosine)
    grazing = xp.maximum(1.0 - cosine, 0.0)
    square = grazing * grazing
    found = schlick(cosine, (normal,) * 3)[0] - dip * cosine * square * square * square
    return xp.minimum(xp.maximum(found, 0.0), 1.0)


def mean_metal(normal: Array, dip: Array) -> Array:
    """Cosine-weighted mean reflectance."""
    return normal + (1.0 - normal) * (1.0 / 21.0) - dip * (1.0 / 126.0)
