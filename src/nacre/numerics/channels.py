"""Colors as luma and two chroma components; permutations of the channels act on the chroma only.

Materials of other hues are materials as well, so what is learned from some counts for every
permutation of their channels. In these coordinates, which are orthonormal, a permutation leaves the
luma as it is and rotates or mirrors the pair of chroma components: covariances fall apart into one
of luma and one that both chroma components share.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Weights

LUMA = math.sqrt(1 / 3)  # weight of each channel in the luma
CHROMA: Weights = np.array(
    [[math.sqrt(1 / 2), -math.sqrt(1 / 2), 0.0], [*[math.sqrt(1 / 6)] * 2, -math.sqrt(2 / 3)]],
    np.float32,
)  # weights of the channels in both chroma components, shape (2, 3)
PERMUTATIONS = np.array(list(itertools.permutations(range(3))))  # of the channels, shape (6, 3)
CHROMA_PERMUTATIONS = CHROMA[:, PERMUTATIONS].swapaxes(0, 1) @ CHROMA.T
"""What each permutation does to the chroma components, shape (6, 2, 2)."""


def split_colors(rgb: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Luma (...,) and chroma components (2, ...) of colors (..., 3)."""
    luma = rgb @ np.full(3, LUMA, rgb.dtype)
    return luma, np.stack([rgb @ weights.astype(rgb.dtype) for weights in CHROMA])
