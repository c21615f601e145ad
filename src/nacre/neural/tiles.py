"""Sizes of the tiles that :mod:`nacre.neural.simd` works in, on this processor."""

from __future__ import annotations

import math

import llvmlite.binding


def _machine() -> tuple[int, int]:
    """Vector lanes, and vectors of samples per tile that the register file holds."""
    features = llvmlite.binding.get_host_cpu_features()
    if features.get("avx512f"):
        return 16, 8
    if features.get("avx"):
        return 8, 4
    return 4, 8


LANES, VECTORS = _machine()
PANEL = LANES * VECTORS  # samples that one call of a dense tile covers
DENSE_ROWS = 3  # output rows of a dense tile
OUTER_ROWS = (3, 7)  # rows of either factor of an outer-product tile
OUTER_SIZE = -(-math.prod(OUTER_ROWS) // LANES) * LANES  # elements that its tile writes
