"""Rotations about the normal that map a set of directions onto itself."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import join, rotate, split
from nacre.measured.textures.directions import SAME

_MAX_ROTATIONS = 24


def symmetric_rotations(wi: Floats, wo: Floats) -> list[npt.NDArray[np.intp]]:
    """Orders of the pairs, shape (n,) each, that stand for the texel rotated about its normal.

    Values v of a texel become v[order] when it is rotated. The first order changes nothing. They
    are the multiples of the smallest angle 2 pi / k, k up to 24, that the set of pairs allows: six
    for the domes of Bonn and UTIA's neighbor, one for scattered directions.
    """
    from scipy.spatial import KDTree

    pairs = np.concatenate([wi, wo], axis=1)
    tree = KDTree(pairs)
    for count in range(_MAX_ROTATIONS, 1, -1):
        orders = [np.arange(len(wi))]
        for k in range(1, count):
            order = _order(tree, wi, wo, 2.0 * math.pi * k / count)
            if order is None:
                break
            orders.append(order)
        if len(orders) == count:
            return orders
    return [np.arange(len(wi))]


def _order(tree: Any, wi: Floats, wo: Floats, angle: float) -> npt.NDArray[np.intp] | None:
    rotated = np.concatenate([join(rotate(split(w), angle)) for w in (wi, wo)], axis=1)
    distance, order = tree.query(rotated, distance_upper_bound=SAME)
    if not np.isfinite(distance).all() or len(np.unique(order)) != len(order):
        return None
    return np.asarray(order, np.intp)
