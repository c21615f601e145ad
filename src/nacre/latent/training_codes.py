"""Codes to train on: those of materials, between and beyond them, and random ones."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.latent.neural_basis import NeuralBasis
from nacre.numerics.channels import PERMUTATIONS

Codes: TypeAlias = npt.NDArray[np.floating]

_STRETCH = -1.0, 2.0
"""Where between, or beyond, two materials a mixture of theirs lies."""
_SCALES = 0.5, 2.5
"""Standard deviations of random codes."""
_JITTER = 0.2
"""Standard deviation that is added to every code."""


def draw_codes(
    basis: NeuralBasis, codes: Codes, count: int, random: np.random.Generator
) -> npt.NDArray[np.float32]:
    """Codes to train on, shape (count, k).

    Two fifths are those of materials, two fifths are mixtures of two, the others are normally
    distributed. Channels of materials change places.
    """

    def materials() -> Codes:
        chosen = codes[random.integers(len(codes), size=count)]
        return basis.reordered(chosen, random.integers(len(PERMUTATIONS), size=count))

    one, other = materials(), materials()
    share = random.uniform(*_STRETCH, (count, 1))
    shape = one.shape
    kind = random.choice(3, (count, 1), p=(0.4, 0.4, 0.2))
    normal = random.uniform(*_SCALES, (count, 1)) * random.normal(size=shape)
    chosen = np.select([kind == 0, kind == 1], [one, share * one + (1.0 - share) * other], normal)
    return (chosen + _JITTER * random.normal(size=shape)).astype(np.float32)
