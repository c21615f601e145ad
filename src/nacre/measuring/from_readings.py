"""A material from readings of instruments, through the prior over codes."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from nacre.array import Doubles
from nacre.instruments.quadrature import SMOOTH
from nacre.instruments.quantities import GlossQuantity, Quantity
from nacre.instruments.readings import Reading
from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.posterior import DARK, Linearized, Posterior
from nacre.latent.sums import Sums

PRECISION = {"gloss": 3.0, "haze": 3.0, "multiangle": 1.3, "sphere": 4.0, "45-0": 2.0, "f_r": 1.0}
"""How much more precisely a code explains a reading than f_r at one pair of directions, by
instrument; found on training materials that bases of others had not seen."""
GRAZING = 0.4
"""The same for gloss at 85 degrees, where training materials were measured poorly."""

_CHANNELS = 3


class Expected:
    """What an instrument would read of the material that a code stands for, on a logarithmic scale.

    Parameters
    ----------
    basis
        Of the codes.
    quantity
        What it reads.
    """

    def __init__(self, basis: NeuralBasis, quantity: Quantity) -> None:
        pairs = quantity.pairs(SMOOTH)
        weights = np.abs(pairs.weights)
        self.quantity = quantity
        self.precision = PRECISION[quantity.instrument]
        if quantity == GlossQuantity(85.0):
            self.precision = GRAZING
        self._sums = Sums(basis, pairs.wi[None], pairs.wo[None], pairs.weights[None, :, None])
        self._dark = DARK * float(weights.sum() ** 2 / (weights @ pairs.wi[:, 2]))

    @staticmethod
    @functools.lru_cache(maxsize=32)
    def known(basis: NeuralBasis, quantity: Quantity) -> Expected:
        """The same, kept for the next call: sums over spheres take a second to set up."""
        return Expected(basis, quantity)

    def logarithm(self, seen: Doubles) -> Doubles:
        """The logarithm of what is seen, (..., c), which at black ends in a straight line."""
        return np.asarray(np.log(np.maximum(seen, 0.0) + self._dark))

    def seen(self, logarithm: Doubles) -> Doubles:
        """The inverse of :meth:`logarithm`."""
        return np.asarray(np.maximum(np.exp(logarithm) - self._dark, 0.0))

    def of(self, code: Doubles) -> Doubles:
        """The logarithm for a code, (c,)."""
        return self.logarithm(self.quantity.seen(self._sums.values(code)[0]))

    def at(self, code: Doubles) -> tuple[Doubles, Doubles]:
        """The logarithm for a code, (c,), and its derivatives by the values of the code, (k, c)."""
        sums, slopes = self._sums.at(code)
        seen = self.quantity.seen(sums[0])
        return self.logarithm(seen), self.quantity.seen(slopes[:, 0]) / self._lit(seen)

    def noise(self, reading: Reading) -> Doubles:
        """Standard deviation of the logarithm of a reading, (c,)."""
        return np.asarray(reading.noise / self._lit(reading.seen))

    def _lit(self, seen: Doubles) -> Doubles:
        return np.asarray(np.maximum(seen, 0.0) + self._dark)


def posterior_of_readings(basis: NeuralBasis, readings: Sequence[Reading]) -> Posterior:
    """The posterior of a material's code, given one reading or more, of different quantities.

    Readings are observations like samples of f_r in :func:`nacre.latent.posterior.search`, with the
    same prior; one that disagrees with the others gets little weight.
    """
    expected = [Expected.known(basis, reading.quantity) for reading in readings]
    read = [each.logarithm(reading.seen) for each, reading in zip(expected, readings, strict=True)]
    noise = [each.noise(reading) for each, reading in zip(expected, readings, strict=True)]

    def linearized(code: Doubles) -> Linearized:
        missed = np.zeros((len(readings), _CHANNELS))
        slopes = np.zeros((basis.code_dim, *missed.shape))
        deviations = np.full(missed.shape, math.inf)
        for row, each in enumerate(expected):
            logarithm, slope = each.at(code)
            channels = len(logarithm)
            missed[row, :channels] = each.precision * (read[row] - logarithm)
            slopes[:, row, :channels] = each.precision * slope
            deviations[row, :channels] = each.precision * noise[row]
        return Linearized(missed, slopes, deviations)

    return basis.inferred(linearized)
