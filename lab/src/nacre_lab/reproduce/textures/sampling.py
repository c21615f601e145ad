"""The pairs of directions from which a texel is encoded, and at which it is compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.measured.textures.domes import below

Pairs: TypeAlias = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Sampling:
    """A choice among a texture's pairs of directions.

    Parameters
    ----------
    name
        In words.
    fraction
        Fraction of the pairs, chosen at random.
    steepest
        Largest polar angle of views in degrees.
    held_out
        Random fraction of the directions; texels are compared at pairs with one of them. If 0, they
        are compared at all pairs.
    hidden
        Whether those pairs are hidden from the encoder.
    """

    name: str
    fraction: float = 1.0
    steepest: float = 90.0
    held_out: float = 0.0
    hidden: bool = False

    def pairs(self, wi: Floats, wo: Floats, seed: int = 0) -> tuple[Pairs, Pairs]:
        """Indices of the seen and of the compared pairs, in order.

        Parameters
        ----------
        wi, wo
            Unit directions, shape (n, 3).
        seed
            Seed of the random choices.

        Raises
        ------
        NacreError
            If no pair is seen.
        """
        random = np.random.default_rng(seed)
        compared = np.ones(len(wi), bool)
        if self.held_out:
            every = np.concatenate([wi, wo]).round(4)
            _, which = np.unique(every, axis=0, return_inverse=True)
            which = which.reshape(-1)
            count = int(which.max()) + 1
            out = np.zeros(count, bool)
            out[random.permutation(count)[: max(1, round(self.held_out * count))]] = True
            compared = out[which[: len(wi)]] | out[which[len(wi) :]]
        seen = below(wo, self.steepest)
        if self.hidden:
            seen &= ~compared
        chosen = np.flatnonzero(seen)
        if not len(chosen):
            raise NacreError(f"no pair of directions can be seen ({self.name})")
        if self.fraction < 1.0:
            count = max(1, round(self.fraction * len(chosen)))
            chosen = np.sort(random.permutation(chosen)[:count])
        return chosen, np.flatnonzero(compared)


ALL = Sampling("100 %")
"""Every pair."""
HELD_OUT = 0.1
"""Fraction of directions held out altogether."""
FRACTIONS = (*(Sampling(f"{percent} %", percent / 100.0) for percent in (1, 2, 5, 10, 20, 50)), ALL)
"""Fractions in Figure 7."""
LOW_VIEWS = Sampling("views below 50 degrees", steepest=50.0)
"""All lights, with views near the normal only."""
AT_HELD_OUT = Sampling("all, compared at some directions", held_out=HELD_OUT)
APART = Sampling("those directions held out", held_out=HELD_OUT, hidden=True)
"""Compared at the same pairs as :data:`AT_HELD_OUT`, but encoded without them."""
