"""The leading singular vectors of matrices that are never in memory as a whole."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from nacre.array import Floats

_OVERSAMPLING = 16
"""Directions followed beyond those asked for, which makes these converge in few passes."""

PASSES = 2
"""Times that the rows are gone through."""

Runs = Callable[[], Iterable[Sequence[Floats]]]
"""Goes through all rows once: yields the same run of rows of each matrix, shapes (b, width)."""


def leading_directions(
    runs: Runs, matrices: int, width: int, count: int, seed: int
) -> list[npt.NDArray[np.float64]]:
    """Approximate right singular vectors of several matrices, which are gone through together.

    Subspace iteration from random directions (Halko, Martinsson and Tropp 2011, "Finding Structure
    with Randomness", algorithm 4.4): products X^T (X Q) are summed over runs of rows of X.

    Parameters
    ----------
    runs
        Gives the rows, :data:`PASSES` times.
    matrices
        How many there are.
    width
        Length of a row.
    count
        Vectors wanted, at most `width`.
    seed
        Of the first directions.

    Returns
    -------
    vectors
        Of each matrix, shape (width, count), orthonormal, the largest singular value first.
    """
    random = np.random.default_rng(seed)
    columns = min(width, count + _OVERSAMPLING)
    bases = [random.standard_normal((width, columns)) for _ in range(matrices)]
    for _ in range(PASSES):
        narrow = [basis.astype(np.float32) for basis in bases]
        sums = np.zeros((matrices, width, columns))
        for run in runs():
            for rows, basis, total in zip(run, narrow, sums, strict=True):
                total += rows.T @ (rows @ basis)
        bases = [np.linalg.svd(total, full_matrices=False)[0] for total in sums]
    return [basis[:, :count] for basis in bases]
