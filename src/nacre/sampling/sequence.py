"""Points that fill a cube evenly."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats


def even_points(count: int, dimensions: int, offset: Floats | float = 0.5) -> Floats:
    """The R sequence (count, dimensions): points in [0, 1) that stay even however many are taken.

    The one before the first is `offset`. See Roberts 2018, "The Unreasonable Effectiveness of
    Quasirandom Sequences".
    """
    # Steps are powers of the inverse of the real root of x^(d + 1) = x + 1, a fixed point.
    root = 2.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1.0)
    return (offset + np.arange(count)[:, None] * steps) % 1.0
