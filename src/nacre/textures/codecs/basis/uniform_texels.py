"""Uniform diffuse texels, so that a codec knows cards of one color among its textures."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.btf import TableBtf


def swatches(wi: Floats, wo: Floats, count: int, seed: int) -> TableBtf:
    """A row of texels, each of one reflectance factor at all pairs of directions.

    Their colors lie anywhere between black and white, dark ones as often as bright ones.

    Parameters
    ----------
    wi, wo
        Unit directions, shape (n, 3).
    count
        Of texels.
    seed
        Of the colors.
    """
    random = np.random.default_rng([seed, count])
    colors = random.random((count, 1, 3), np.float32) * random.random((count, 1, 1), np.float32)
    return TableBtf(np.broadcast_to(colors[None], (1, count, len(wi), 3)), wi, wo, "swatches")
