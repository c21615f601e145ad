"""Principal components of texels, each counted with its rotations about the normal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from nacre.array import Floats
from nacre.geometry import join, split, turn
from nacre.measured.textures.directions import SAME

_MAX_ROTATIONS = 24


def symmetric_rotations(wi: Floats, wo: Floats) -> list[npt.NDArray[np.intp]]:
    """Orders of the pairs, shape (n,) each, that stand for the texel rotated about its normal.

    Values v of a texel become v[order] when it is rotated. The first order changes nothing. They
    are the multiples of the smallest angle 2 pi / k, k up to 24, that the set of pairs allows: six
    for the domes of Bonn and UTIA's neighbor, one for scattered directions.
    """
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
    turned = np.concatenate([join(turn(split(w), angle)) for w in (wi, wo)], axis=1)
    distance, order = tree.query(turned, distance_upper_bound=SAME)
    if not np.isfinite(distance).all() or len(np.unique(order)) != len(order):
        return None
    return np.asarray(order, np.intp)


_OVERSAMPLING = 16
_POWERS = 4


def principal_functions(
    rows: Floats, orders: Sequence[npt.NDArray[Any]], count: int, seed: int = 0
) -> tuple[Floats, Floats]:
    """The leading components of data that are counted in several orders of their columns.

    Subspace iteration (Halko, Martinsson and Tropp 2011); the reordered data are never made.

    Parameters
    ----------
    rows
        Shape (texels, n).
    orders
        A group of orders of the n columns, see
        :func:`nacre.textures.codecs.texel_components.symmetric_rotations`.
    count
        Of components.
    seed
        Of the subspace it begins with.

    Returns
    -------
    tuple
        Orthonormal components, shape (n, count), the strongest first, and their variances: mean
        squares of the data along them, shape (count,).
    """
    width = min(count + _OVERSAMPLING, rows.shape[1])
    random = np.random.default_rng(seed)
    space = random.standard_normal((rows.shape[1], width), dtype=np.float32)
    for _ in range(_POWERS):
        space = np.linalg.qr(space)[0]
        powered = np.zeros_like(space)
        for order in orders:
            powered[order] += rows.T @ (rows @ space[order])
        space = powered
    space = np.linalg.qr(space)[0]
    covariance = np.zeros((width, width))
    for order in orders:
        projected = rows @ space[order]
        covariance += projected.T @ projected
    variances, vectors = np.linalg.eigh(covariance / (len(rows) * len(orders)))
    best = np.argsort(variances)[::-1][:count]
    return space @ vectors[:, best].astype(np.float32), variances[best].astype(np.float32)
