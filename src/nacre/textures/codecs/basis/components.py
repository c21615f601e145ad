"""Principal components of texels, each counted with its turns about the normal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats

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
        :func:`nacre.textures.codecs.basis.symmetry.symmetric_turns`.
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
