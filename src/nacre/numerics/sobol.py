"""Scrambled Sobol points, as `scipy.stats.qmc` makes them, whose import takes a second."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

BITS = 30
"""Of a coordinate."""
_POLYNOMIALS = ((0, 0, ()), (1, 0, (1,)), (2, 1, (1, 3)), (3, 1, (1, 3, 1)), (3, 2, (1, 1, 1)))
"""Degree, inner coefficients and first direction numbers of a dimension (Joe and Kuo 2008)."""
DIMENSIONS = len(_POLYNOMIALS)
"""As many as there are numbers here for."""


def sobol(dimensions: int, log2_count: int, random: np.random.Generator) -> npt.NDArray[np.float64]:
    """Points of a Sobol sequence, scrambled: a matrix for each dimension, and a shift.

    Parameters
    ----------
    dimensions
        At most :data:`DIMENSIONS`.
    log2_count
        The logarithm of the number of points, at most :data:`BITS`.
    random
        A generator that it spawns draws the scrambling (Matoušek 1998).

    Returns
    -------
    points
        In [0, 1), shape (2 ** log2_count, dimensions), in the order of Gray's code.
    """
    (random,) = random.spawn(1)
    columns = np.array([_columns(*each) for each in _POLYNOMIALS[:dimensions]], np.uint32)
    places = np.arange(BITS, dtype=np.uint32)
    shift = random.integers(2, size=(dimensions, BITS), dtype=np.uint32) @ (1 << places)
    rows = np.tril(random.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32))
    rows |= np.eye(BITS, dtype=np.uint32)
    # Bits from the highest to the lowest: a row of a matrix takes those at and above its own.
    bits = columns[:, :, None] >> places[::-1] & 1
    mixed = np.einsum("dpk,djk->djp", rows, bits) & 1
    columns = (mixed @ (1 << places[::-1])).astype(np.uint32)
    points = shift.astype(np.uint32)[None]
    for place in range(log2_count):
        points = np.concatenate([points, points[::-1] ^ columns[:, place]])
    return points / float(1 << BITS)


@cache
def _columns(degree: int, inner: int, first: tuple[int, ...]) -> list[int]:
    """Direction numbers of a dimension, each shifted to the highest of :data:`BITS` bits."""
    numbers = list(first) if degree else [1] * BITS
    while len(numbers) < BITS:
        number = numbers[-degree] ^ numbers[-degree] << degree
        for place in range(1, degree):
            if inner >> (degree - 1 - place) & 1:
                number ^= numbers[-place] << place
        numbers.append(number)
    return [number << (BITS - 1 - place) for place, number in enumerate(numbers)]
