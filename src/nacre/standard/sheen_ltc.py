"""Sheen of fibers as a linearly transformed cosine: in Cycles by tables, in MaterialX by fits.

Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly Transformed
Cosines": in the plane of the viewer the cosine is stretched by 1 / a and sheared by -b / a, and
scaled to the albedo of a layer of fibers.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from nacre.array import Array, Components, Table, namespace
from nacre.geometry import polar_sine
from nacre.standard.lookup import interpolate

MIN_FITTED_ROUGHNESS = 0.01
"""Where the fits of :func:`fitted_sheen` begin."""


@cache
def _tables() -> tuple[Table, ...]:
    """Tables of a, b and the albedo, with axes roughness and cosine of the viewer.

    They are solved from renderings of the node's sheen by Cycles 5.0 under eight lights
    (lab/studies/parity/principled_tables.py).
    """
    return tuple(Table(t) for t in np.load(Path(__file__).with_name("sheen_ltc.npy")))


def ltc_sheen(wi: Components, wo: Components, roughness: Array) -> tuple[Array, Array]:
    """f_r in 1/sr of fibers that absorb nothing, and the albedo toward the viewer, as in Cycles.

    The roughness is in [0, 1].
    """
    a, b, albedo = (interpolate(table, roughness, wo[2]) for table in _tables())
    x = (wi[0] * wo[0] + wi[1] * wo[1]) / polar_sine(wo)
    flat = wi[0] * wi[0] + wi[1] * wi[1]
    # The square of (a x + b z, a y, z), with x^2 + y^2 as it is.
    squares = a * a * flat + (2.0 * a * b * x + (b * b + 1.0) * wi[2]) * wi[2]
    ratio = a / squares
    return albedo * ratio * ratio * (1.0 / math.pi), albedo


def fitted_sheen(wi: Components, wo: Components, roughness: Array) -> tuple[Array, Array]:
    """The same as in MaterialX, by rational fits to the tables; the roughness is in [0.01, 1].

    The fits are those of libraries/pbrlib/genglsl/lib/mx_microfacet_sheen.glsl.
    """
    xp = namespace(*wi, *wo)
    x, y = wo[2], roughness
    width = y * (0.0206607 + 1.58491 * y) / (0.0379424 + y * (1.32227 + y))
    place = y * (-0.193854 + y * (-1.14885 + y * (1.7932 - 0.95943 * y * y))) / (0.046391 + y)
    base = y * (0.000654023 + (-0.0207818 + 0.119681 * y) * y) / (1.26264 + y * (-1.92021 + y))
    distance = (x - place) / width
    height = 1.0 / (width * math.sqrt(2.0 * math.pi))
    albedo = xp.exp(-0.5 * distance * distance) * height + base

    a = (2.58126 * x + 0.813703 * y) * y / (1.0 + 0.310327 * x * x + 2.60994 * x * y)
    # The shear is b sqrt(1 - x), along the projection of wo, of length sqrt(1 - x^2).
    b = (y - 1.0) * y * y * y / (0.0000254053 + 1.71228 * x - 1.71506 * x * y + 1.34174 * y * y)
    along = (wi[0] * wo[0] + wi[1] * wo[1]) / xp.sqrt(1.0 + x)
    flat = wi[0] * wi[0] + wi[1] * wi[1]
    squares = a * a * flat + 2.0 * a * b * along * wi[2] + (b * b * (1.0 - x) + 1.0) * wi[2] * wi[2]
    ratio = a / squares
    return albedo * ratio * ratio * (1.0 / math.pi), albedo
