"""What samples of a material, however few, tell about its code."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.runtime.parallel import one_blas_thread

UNEXPLAINED = 0.13
"""Standard deviation of ln f_r, at single pairs of directions, that no code explains."""
DARK = 1e-3  # added to f cos theta_i before logarithms
LOOSE = 0.3
"""Standard deviation of the logarithm of the factor of an instrument that may be wrong."""

_WIDTHS = 0.3, 0.5, 0.8  # of the prior about each training material, in standard deviations
_NOISES = 0.1, 0.2, 0.4  # standard deviations of the logarithm of what is left unexplained
_TRUST = 0.4  # power of the likelihood: neighboring directions and channels err alike
_DOUBT = 0.15  # power of the weights of parts where codes are drawn
_SPREAD = 0.9, 30.0
"""a and b: deviations are wider by the root of a + n / b with n samples, which err alike."""
_STEPS = 20
_LONGEST, _PART = 1.0, 0.7
"""Change of a value in one step, and the part of a step that is taken: far from where it was
linearized, the logarithm may be another one."""
_CLOSE = 1e-2  # change of the values below which a step is the last
_TYPICAL, _FREEDOM = 0.3, 3.0
"""Deviation of the logarithm next to which noise counts; degrees of freedom of the Student
distribution that tells outliers."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Codes that samples leave possible: a mixture of normal distributions."""

    weights: Doubles  # of the m parts, which add up to 1
    means: Doubles
    """Means of the parts, shape (m, k); with further values, as the logarithm of the scale in
    :data:`LOOSE`, (m, k + 1) or more."""
    deviations: Doubles  # standard deviations of the parts along the axes, shaped as the means
    axes: Doubles  # columns are directions, orthonormal, shape (k, k) or (k + 1, k + 1)
    code_dim: int
    doubts: Doubles
    """Flatter weights of the parts, (m,), by which codes are drawn: the parts are not all that a
    material can be like."""

    @property
    def mean(self) -> Doubles:
        """Mean of the whole, shape (k,) or (k + 1,)."""
        return np.asarray(self.weights @ self.means)

    @property
    def code(self) -> Doubles:
        """The expected code, shape (k,)."""
        return self.mean[: self.code_dim]

    @property
    def factors(self) -> Doubles:
        """What the further values stand for, shape (0,) or more: factors of what is observed."""
        return np.asarray(np.exp(LOOSE * self.mean[self.code_dim :]))

    @property
    def scale(self) -> tuple[float, float] | None:
        """Factor of the instrument and the standard deviation of its logarithm, where it is free.

        Samples are the factor times what the code stands for.
        """
        if self.means.shape[1] == self.code_dim:
            return None
        parts, middle = self.means[:, -1], self.mean[-1]
        within = (self.axes[-1] * self.deviations) ** 2
        variance = self.weights @ (within.sum(axis=1) + (parts - middle) ** 2)
        return float(self.factors[-1]), LOOSE * math.sqrt(variance)

    def draw(self, count: int, seed: int = 0) -> Doubles:
        """Codes drawn from it, shape (count, k); the same seed gives the same ones."""
        random = np.random.default_rng((seed, 8))
        parts = random.choice(len(self.doubts), count, p=self.doubts)
        # Turned onto the axes and back, so that it does not matter which of equal axes were found.
        turned = random.normal(size=self.means[parts].shape) @ self.axes
        offsets = (self.deviations[parts] * turned) @ self.axes.T
        return np.asarray(self.means[parts] + offsets)[:, : self.code_dim]


class Linearized(NamedTuple):
    """Logarithms of n observations in three channels, near some values to be found, counted so that
    :data:`_NOISES` are what no code explains of them.
    """

    missed: Doubles  # observed less expected, shape (n, 3)
    slopes: Doubles  # derivatives of the expected ones by the values, shape (k, n, 3)
    noise: Doubles
    """Standard deviations beside what no code explains, shape (n, 3); infinite where a channel was
    not observed."""


def search(
    centers: Doubles,
    linearized: Callable[[Doubles], Linearized],
    code_dim: int,
    extra: int = 0,
) -> Posterior:
    """What observations say of a code, and of `extra` values beside it.

    Before they are known, a code is held to be near one of the centers, shape (m, code_dim), or to
    be anywhere in the normal distribution; further values are normally distributed about 0, with a
    standard deviation of 1 at most. `linearized` gives the observations near a code and further
    values, shape (code_dim + extra,): they turn each of these normal distributions into another
    one, and tell how likely it was. The mixture of all is found again where its mean is linearized
    until that stays. An observation that disagrees with the others gets little weight.

    How wide the parts are was chosen on training materials that bases of others had not seen, so
    that intervals hold as often as they say.
    """
    centers = np.pad(centers, ((0, 0), (0, extra)))
    mean = np.zeros(code_dim + extra)
    with one_blas_thread():
        for step in range(_STEPS):
            missed, slopes, noise = linearized(mean)
            variance = 1.0 + np.square(noise / _TYPICAL)
            observed = np.isfinite(noise)
            if step:
                variance = variance * _outlying(missed, variance, observed)
            deviation = np.sqrt(variance[observed])
            flat = slopes[:, observed]
            left = (missed[observed] + mean @ flat) / deviation
            found = _mixture(left, flat / deviation, centers, code_dim)
            change = found.mean - mean
            if np.abs(change).max() < _CLOSE:
                break
            mean = mean + _PART * np.clip(change, -_LONGEST, _LONGEST)
    wider = math.sqrt(_SPREAD[0] + len(missed) / _SPREAD[1])
    return replace(found, deviations=wider * found.deviations)


def _outlying(missed: Doubles, variance: Doubles, observed: npt.NDArray[np.bool_]) -> Doubles:
    """Factors (n, 1) of the variances of samples, (n, 3), by what they miss: Student's."""
    squares = np.square(missed) / (_TYPICAL**2 * variance)
    ratio = squares.mean(axis=1, keepdims=True, where=observed)
    return np.asarray(np.maximum((_FREEDOM + ratio) / (_FREEDOM + 1.0), 1.0))


def _mixture(values: Doubles, slopes: Doubles, centers: Doubles, code_dim: int) -> Posterior:
    """Codes whose products with slopes, (k, n), are values, (n,), up to noise."""
    gram, product = slopes @ slopes.T, slopes @ values
    squares, axes = np.linalg.eigh(gram)
    anywhere = np.zeros((1, len(slopes)))
    priors = [(centers, width) for width in _WIDTHS if len(centers)] + [(anywhere, 1.0)]
    logs, means, deviations = [], [], []
    for center, width in priors:
        expected = center @ gram
        length = values @ values + ((expected - 2.0 * product) * center).sum(axis=1)
        pulls = (product - expected) @ axes
        for noise in _NOISES:
            precision = squares / noise**2 + 1.0 / width**2
            moved = pulls / (noise**2 * precision)
            fit = (length - (pulls * moved).sum(axis=1)) / noise**2 + np.log(precision).sum()
            spread = 2.0 * len(slopes) * math.log(width) + 2.0 * len(values) * math.log(noise)
            logs.append(-0.5 * _TRUST * (fit + spread) - math.log(len(center)))
            means.append(center + moved @ axes.T)
            deviations.append(np.broadcast_to(precision**-0.5, center.shape))
    likelihood = np.concatenate(logs)
    likelihood -= likelihood.max()
    weights, doubts = (np.exp(power * likelihood) for power in (1.0, _DOUBT))
    weights /= weights.sum()
    doubts /= doubts.sum()
    parts = np.concatenate(means), np.concatenate(deviations)
    return Posterior(weights, *parts, axes, code_dim, doubts)
