"""Codes of materials that few samples are known of."""

from __future__ import annotations

import math

import numpy as np

from nacre.latent.basis import Vector
from nacre.latent.neural_basis import NeuralBasis, decoded
from nacre.numerics.channels import PERMUTATIONS
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.parallel import one_blas_thread

MAX_SAMPLES = 2048  # samples that count: of more, a code has nothing to learn
_EPSILON = 1e-3  # added to f cos theta_i before logarithms
_WIDTHS = 0.3, 0.5, 0.8  # of the prior about each training material, in standard deviations
_NOISES = 0.15, 0.3, 0.6  # standard deviations of the logarithm of what is left unexplained
_TRUST = 0.1  # power of the likelihood: neighboring directions and channels err alike
_STEPS = 12
_LONGEST, _PART = 1.0, 0.7
"""Change of a value in one step, and the part of a step that is taken: far from where it was
linearized, the logarithm may be another one."""
_CLOSE = 1e-2  # change of the values by which the last step is known


def expected_code(basis: NeuralBasis, samples: DirectionSamples) -> Vector:
    """The code (k,) that is to be expected of a material with these samples, however few.

    Before the samples are known, a code is held to be near that of a training material or of one
    with its channels permuted, or to be anywhere in the normal distribution. ln(f cos theta_i + e)
    is nearly linear in the code, so samples turn each of these normal distributions into another
    one, and give how likely it was; the result is the mean over all of them, found again where it
    is linearized until it stays.

    Only :data:`MAX_SAMPLES` count, the same each time. Raises ValueError if there are none.
    """
    if not len(samples):
        raise ValueError("a code needs one sample or more")
    if len(samples) > MAX_SAMPLES:
        samples = samples[np.random.default_rng(0).permutation(len(samples))[:MAX_SAMPLES]]
    with one_blas_thread():
        common, rows = (a.astype(np.float64) for a in basis.logarithms(samples.wi, samples.wo))
        cosine = samples.cosine[:, None].astype(np.float64)
        target = np.log(np.maximum(samples.rgb, 0.0) * cosine + _EPSILON)
        known = basis.examples.astype(np.float64)
        centers = np.concatenate([basis.permuted(known, p) for p in range(len(PERMUTATIONS))])
        code = np.zeros(basis.code_dim)
        for step in range(1, _STEPS + 1):
            scaled = decoded(common, rows, code) * cosine
            slopes = (rows * (scaled / (scaled + _EPSILON))).reshape(len(code), -1)
            left = (target - np.log(scaled + _EPSILON)).reshape(-1) + code @ slopes
            change = _expected(left, slopes, centers) - code
            last = step == _STEPS or np.abs(change).max() < _CLOSE
            code = code + np.clip(change, -_LONGEST, _LONGEST) * (1.0 if last else _PART)
            if last:
                break
    return np.asarray(code)


def _expected(values: Vector, slopes: Vector, centers: Vector) -> Vector:
    """Mean of the codes whose products with slopes, (k, n), give values, (n,), but for noise."""
    squares, axes = np.linalg.eigh(slopes @ slopes.T)
    anywhere = np.zeros((1, len(slopes)))
    priors = [(centers, width) for width in _WIDTHS if len(centers)] + [(anywhere, 1.0)]
    logs, means = [], []
    for center, width in priors:
        missed = values - center @ slopes
        length, pulls = (missed**2).sum(axis=1), missed @ slopes.T @ axes
        for noise in _NOISES:
            precision = squares / noise**2 + 1.0 / width**2
            moved = pulls / (noise**2 * precision)
            fit = (length - (pulls * moved).sum(axis=1)) / noise**2 + np.log(precision).sum()
            spread = 2.0 * len(slopes) * math.log(width) + 2.0 * len(values) * math.log(noise)
            logs.append(-0.5 * _TRUST * (fit + spread) - math.log(len(center)))
            means.append(center + moved @ axes.T)
    likelihood = np.concatenate(logs)
    weights = np.exp(likelihood - likelihood.max())
    return np.asarray(weights @ np.concatenate(means) / weights.sum())
