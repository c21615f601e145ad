"""Sizes of tiles of matrix products, whose sums stay in this processor's registers."""

from __future__ import annotations

import llvmlite.binding
import numpy as np

from nacre.array import Floats, aligned_zeros
from nacre.compile.vector_code import LANES

_FEATURES = llvmlite.binding.get_host_cpu_features()

HALVES = bool(_FEATURES.get("f16c") or _FEATURES.get("neon"))
"""Whether an instruction makes single floats of half ones."""
ROWS = 8 if LANES == 16 or _FEATURES.get("neon") else 4
"""Of a tile as wide as a panel; one of a vector has twice as many."""
PANEL = 2 * LANES
BLOCK = 128
"""Terms of a tile: few enough for a block of every row to stay in the cache."""


def padded(count: int, step: int) -> int:
    """The next multiple of a step."""
    return -(-count // step) * step


def panels(matrix: Floats, width: int = PANEL, columns: int = 0) -> Floats:
    """A matrix (n, k) as tiles read it: (blocks, panels, BLOCK, `width`), padded with zeros.

    There are panels for so many `columns` at least.
    """
    terms, count = matrix.shape
    blocks, across = -(-terms // BLOCK), -(-max(count, columns) // width)
    whole = np.zeros((blocks * BLOCK, across * width), np.float32)
    whole[:terms, :count] = matrix
    parts = whole.reshape(blocks, BLOCK, across, width).swapaxes(1, 2)
    result: Floats = aligned_zeros(parts.shape)
    result[:] = parts
    return result
