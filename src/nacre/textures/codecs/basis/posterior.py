"""The coefficients and codes to expect, given reflectance at any directions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, aligned_zeros
from nacre.compile.compilation import Compiled
from nacre.compile.vector_code import LANES
from nacre.textures.codecs.basis.moments import Moments
from nacre.textures.codecs.basis.networks import FunctionValues, SkipNetwork

Double = npt.NDArray[np.float64]

_DAMPING = np.float32(1.0 + 1e-2)  # factor on diagonals of steps
_FLOOR = np.float32(1e-12)
_PART = 64  # texels that take steps at a time, so that slopes stay in the cache

_step = Compiled("nacre.textures.codecs.basis.projection_loops:step")


@dataclass(frozen=True, eq=False)
class Prior:
    """What coefficients are like, from the texels of the training.

    The covariance is that of coefficients about completed ones, relative to the mean square of a
    texel; (0, 0) before the training.
    """

    deviations: Floats  # root mean squares of coefficients, shape (K,)
    noise: float
    """Variance of roots of reflectance about sums of the functions: what these cannot express, and
    noise."""
    covariance: Floats  # shape (K, K)
    relative_noise: float  # the noise in the units of the covariance


class Observation:
    """What functions at a set of directions say about coefficients, given their prior."""

    def __init__(self, functions: FunctionValues, prior: Prior) -> None:
        self.functions, self.prior = functions, prior
        luma, chroma = (
            block.astype(np.float64).T @ block for block in (functions.luma, functions.chroma)
        )
        count = len(luma)
        self.gram: Double = np.zeros((count + 2 * len(chroma),) * 2)
        self.gram[:count, :count] = luma
        self.gram[count:, count:] = np.kron(np.eye(2), chroma)

    @cached_property
    def moments(self) -> Moments:
        """Products of the functions with roots of reflectance (b, n, 3) less the mean: (b, K)."""
        return Moments(self.functions)

    @cached_property
    def _ridge(self) -> Double:
        deviations = np.maximum(self.prior.deviations.astype(np.float64), 1e-9)
        inverse = np.linalg.inv(self.gram + np.diag(self.prior.noise / deviations**2))
        return np.asarray(inverse, np.float64)

    @cached_property
    def known(self) -> Floats:
        """The fraction of each coefficient that the directions determine, 0 to 1, shape (K,)."""
        return np.diag(self._ridge @ self.gram).astype(np.float32)

    def ridge(self, moments: Floats) -> Floats:
        """Coefficients (b, K) by least squares with the prior's variances."""
        return moments @ self._ridge.astype(np.float32)

    @cached_property
    def _gain(self) -> Floats:
        covariance = self.prior.covariance.astype(np.float64)
        noise = self.prior.relative_noise * np.eye(len(covariance))
        return (np.linalg.inv(noise + self.gram @ covariance).T @ covariance).astype(np.float32)

    def expected(self, guess: Floats, moments: Floats) -> Floats:
        """Coefficients (b, K) to expect where a guess is as wrong as it was in the training.

        Where much is known they are those of least squares, elsewhere those of the guess.
        """
        return guess + (moments - guess @ self.gram.astype(np.float32)) @ self._gain


def project(codes: Floats, wanted: Floats, decode: SkipNetwork, steps: int) -> Floats:
    """Codes (b, values) whose coefficients are closest to those wanted, shape (b, K).

    Takes Gauss-Newton steps from given codes; codes that these do not bring closer stay.
    """
    found = codes.astype(np.float32)
    factor = aligned_zeros((codes.shape[1] + 1) * codes.shape[1] * LANES)
    for start in range(0, len(codes), _PART):
        part = slice(start, start + _PART)
        for _ in range(steps):
            value, slopes = decode.jacobian(found[part])
            _step(slopes, wanted[part] - value, _DAMPING, _FLOOR, factor, found[part])
    before, after = (np.square(wanted - decode(c)).sum(1) for c in (codes, found))
    return np.where((after < before)[:, None], found, codes)
