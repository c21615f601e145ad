"""Sheen of fibers: a linearly transformed cosine."""

from __future__ import annotations

import math

from nacre.array import Array, Components, namespace

MIN_SHEEN_ROUGHNESS = 0.01  # where the fits begin


def sheen(wi: Components, wo: Components, roughness: Array) -> tuple[Array, Array]:
    """f_r in 1/sr of fibers that absorb nothing, and the albedo in direction `wo`.

    Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly Transformed
    Cosines", with the rational fits of MaterialX to its tables (libraries/pbrlib/genglsl/lib/
    mx_microfacet_sheen.glsl).

    Parameters
    ----------
    roughness
        In [0.01, 1].
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
