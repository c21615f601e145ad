"""Colors as a gray value and a pair, in which orders of the channels are turns of the pair.

Materials of other hues are materials as well, so what is learned from some counts for every order
of their channels. In these coordinates, which are orthonormal, an order leaves the gray value as it
is and turns or mirrors the pair: covariances fall apart into one of gray values and one that both
values of pairs share.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

GREY = math.sqrt(1 / 3)
"""Weight of each channel in the gray value."""
CHROMA: npt.NDArray[np.float32] = np.array(
    [[math.sqrt(1 / 2), -math.sqrt(1 / 2), 0.0], [*[math.sqrt(1 / 6)] * 2, -math.sqrt(2 / 3)]],
    np.float32,
)
"""Weights of the channels in the two values of the pair, shape (2, 3)."""
ORDERS = np.array(list(itertools.permutations(range(3))))
"""Of the channels, shape (6, 3)."""
TURNS = CHROMA[:, ORDERS].swapaxes(0, 1) @ CHROMA.T
"""What each order does to a pair, shape (6, 2, 2)."""


def split_colors(rgb: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Gray values (...,) and pairs (2, ...) of colors (..., 3)."""
    grey = rgb @ np.full(3, GREY, rgb.dtype)
    return grey, np.stack([rgb @ weights.astype(rgb.dtype) for weights in CHROMA])
