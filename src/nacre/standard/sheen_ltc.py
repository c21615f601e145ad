"""Sheen of fibers as Cycles has it: a linearly transformed cosine, by tables.

Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly Transformed
Cosines": in the plane of the viewer the cosine is stretched by 1 / a and sheared by -b / a, and it
is scaled to the albedo of a layer of fibers.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from nacre.array import Array, Components, Table
from nacre.geometry import polar_sine
from nacre.standard.lookup import interpolate


@cache
def _tables() -> tuple[Table, ...]:
    """Those of a, b and the albedo, with axes roughness and cosine of the viewer: what Cycles 5.0
    renders of the node's sheen under eight lights, solved for them
    (lab/studies/parity/principled_tables.py).
    """
    return tuple(Table(t) for t in np.load(Path(__file__).with_name("sheen_ltc.npy")))


def ltc_sheen(wi: Components, wo: Components, roughness: Array) -> tuple[Array, Array]:
    """f_r in 1/sr of fibers that absorb nothing, and the albedo toward the viewer.

    Parameters
    ----------
    roughness
        In [0, 1].
    """
    a, b, albedo = (interpolate(table, roughness, wo[2]) for table in _tables())
    x = (wi[0] * wo[0] + wi[1] * wo[1]) / polar_sine(wo)
    flat = wi[0] * wi[0] + wi[1] * wi[1]
    # The square of (a x + b z, a y, z), with x^2 + y^2 as it is.
    squares = a * a * flat + (2.0 * a * b * x + (b * b + 1.0) * wi[2]) * wi[2]
    ratio = a / squares
    return albedo * ratio * ratio * (1.0 / math.pi), albedo
