"""Principal components: of few rows or many, of rows that are never in memory as a whole, of rows
that count in several orders of their columns, and of colors with all permutations of the channels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats, Weights
from nacre.numerics.channels import CHROMA, LUMA

_OVERSAMPLING = 16  # directions beyond those asked for, which make these converge in few passes
_POWERS = 4  # passes over rows in memory
PASSES = 2  # times that leading_directions goes through the rows

BY_CHANNEL = (np.eye(3),)
"""Every channel counts as a row of its own; see :class:`ColoredComponents`."""
BY_PERMUTATION = (np.full((1, 3), LUMA), CHROMA.astype(np.float64))
"""Every color counts with its six permutations of the channels: a component belongs to the luma, or
to both chroma components."""

Runs = Callable[[], Iterable[Sequence[Floats]]]
"""Goes through all rows once: yields the same run of rows of each matrix, shapes (b, width)."""


def largest_first(matrix: Floats, count: int | None = None) -> tuple[Doubles, Doubles]:
    """The k largest eigenvalues of a symmetric (n, n), largest first; eigenvectors (n, k)."""
    values, vectors = np.linalg.eigh(np.asarray(matrix, np.float64))
    return values[::-1][:count], vectors[:, ::-1][:, :count]


def snapshots(slabs: Callable[[], Iterable[Floats]], count: int) -> tuple[Doubles, Weights]:
    """Components of few rows of many columns, from the products of the rows with each other.

    `slabs` goes through the columns once, a slab of shape (rows, b) at a time, and is called twice;
    the mean is subtracted already. Returns the sums of the squares of the rows along each
    component, the largest first, and unit vectors (components, columns). Components without
    variance are left out.
    """
    gram = sum(np.asarray(slab @ slab.T) for slab in slabs())
    squares, vectors = largest_first(np.asarray(gram), count)
    kept = squares > 1e-9 * squares[0]
    scaled = vectors[:, kept] / np.sqrt(squares[kept])
    components = np.concatenate([scaled.T @ slab for slab in slabs()], axis=1)
    return squares[kept], components.astype(np.float32)


def leading_components(
    rows: Floats, orders: Sequence[npt.NDArray[Any]], count: int, seed: int = 0
) -> tuple[Floats, Floats]:
    """The leading components of rows (rows, n) that count in several orders of their columns.

    Subspace iteration (Halko, Martinsson and Tropp 2011); the reordered rows are never made. Orders
    are a group, like those of :func:`nacre.textures.codecs.symmetry.symmetric_rotations`. Returns
    orthonormal components (n, count), the strongest first, and their variances: mean squares of the
    rows along them, (count,).
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
    variances, vectors = largest_first(covariance / (len(rows) * len(orders)), count)
    return space @ vectors.astype(np.float32), variances.astype(np.float32)


def leading_directions(
    runs: Runs, matrices: int, width: int, count: int, seed: int
) -> list[Doubles]:
    """Approximate right singular vectors of several matrices in shared passes over their rows.

    Subspace iteration from random directions (Halko, Martinsson and Tropp 2011, "Finding Structure
    with Randomness", algorithm 4.4): products X^T (X Q) are summed over runs of rows of X, of
    length `width`, in :data:`PASSES` passes. Each matrix gets `count` orthonormal vectors, shape
    (width, count), the largest singular value first.
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


class ColoredComponents(NamedTuple):
    """Which components a code of colors has room for.

    The covariance of colors that count with all permutations of their channels commutes with these:
    its eigenvectors are products of a component with the luma, or with each of two chroma
    components. So components are found for the luma and the chroma apart, each at a third of the
    size, and the strongest are chosen.
    """

    part: npt.NDArray[np.int64]  # which of the parts each comes from, shape (k,)
    component: npt.NDArray[np.int64]  # which component of the part, shape (k,)
    colors: Floats  # its unit color, shape (k, 3)
    variances: Doubles  # of each, largest first, shape (k,)


def strongest(
    variances: Sequence[npt.ArrayLike], colors: Sequence[Floats], count: int
) -> ColoredComponents:
    """The components with the largest variances, at most `count`; of both colors of a component the
    second may be left out.

    Variances are those of the components of each part, colors (colors, 3) its
    :data:`BY_PERMUTATION` or :data:`BY_CHANNEL`.
    """
    rows = [
        (float(variance), part, index, color)
        for part, (found, its_colors) in enumerate(zip(variances, colors, strict=True))
        for index, variance in enumerate(np.asarray(found))
        for color in its_colors
    ]
    rows.sort(key=lambda row: -row[0])  # stable: colors of one component stay together
    chosen = rows[:count]
    return ColoredComponents(
        np.array([part for _, part, _, _ in chosen], np.int64),
        np.array([index for _, _, index, _ in chosen], np.int64),
        np.array([color for *_, color in chosen]).reshape(-1, 3),
        np.array([variance for variance, *_ in chosen]),
    )
