"""Codes of materials in bases whose codes stand for networks of 675 weights."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.direction_samples import DirectionSamples
from nacre.latent.refine import GAIN
from nacre.latent.weights import FARTHEST, SHAPES, Matrix, WeightBasis, shortened
from nacre.least_absolute import minimise
from nacre.neural.samples import direction_inputs
from nacre.parallel import one_blas_thread

_STEPS = 8
_DIFFERENCE = 1e-4
"""Change of a value by which its effect on the weights is found."""
_LARGEST = 30.0
"""Bound of ln(f_r + 1) while a code is sought."""

Floats = npt.NDArray[np.float32]


def refine(
    basis: WeightBasis, samples: DirectionSamples, start: npt.ArrayLike, prior: float
) -> Matrix:
    """The code whose network comes closest to samples of an isotropic material, near a start.

    The mean absolute difference of log(1 + 30 f cos theta_i) is brought to a minimum, together with
    the absolute values of the code.

    Parameters
    ----------
    basis
        What the code is for.
    samples
        Of the material, one or more.
    start
        Code to begin at, shape (k,).
    prior
        Weight of the absolute values of the code.

    Returns
    -------
    array of shape (k,)
    """
    inputs = direction_inputs(samples, True).astype(np.float32)
    weight = (GAIN * samples.cosine[:, None]).astype(np.float32)
    target = np.log1p(np.maximum(samples.rgb, 0.0) * weight)
    pull = prior * np.eye(len(basis))

    def residuals(code: Matrix) -> Matrix:
        weights = basis.weights(shortened(code)[None])[0].astype(np.float32)
        u = np.expm1(np.minimum(_outputs(weights, inputs)[0], _LARGEST)) * weight
        difference = np.copysign(np.log1p(np.abs(u)), u) - target
        return np.concatenate([difference.reshape(-1).astype(np.float64), prior * code])

    def jacobian(code: Matrix, _: Matrix) -> Matrix:
        weights = basis.weights(shortened(code)[None])[0].astype(np.float32)
        y, tangents = _outputs(weights, inputs, weight_tangents(basis, code).astype(np.float32))
        e = np.exp(np.minimum(y, _LARGEST))
        rate = (y < _LARGEST) * e * weight / (1.0 + np.abs((e - 1.0) * weight))
        rows = (tangents * rate).reshape(len(code), -1)
        return np.concatenate([rows.astype(np.float64), pull], axis=1)

    with one_blas_thread():
        limit = FARTHEST * np.sqrt(len(basis))
        return minimise(residuals, jacobian, np.asarray(start, np.float64), _STEPS, limit)[0]


def weight_tangents(basis: WeightBasis, code: npt.ArrayLike) -> Matrix:
    """Derivatives of the weights of a code by its values, by differences, shape (k, 675)."""
    values = np.asarray(code, np.float64)
    offsets = _DIFFERENCE * np.eye(len(values))
    moved = np.stack([shortened(values + o) for o in (*offsets, *-offsets)])
    above, below = np.split(basis.weights(moved), 2)
    found: Matrix = (above - below) / (2.0 * _DIFFERENCE)
    return found


def _outputs(
    weights: Floats, inputs: Floats, tangents: Floats | None = None
) -> tuple[Floats, Floats]:
    """ln(f_r + 1) of a network, shape (n, 3), and its derivatives along `tangents`, (k, n, 3).

    Tangents are directions among weights, shape (k, 675).
    """
    if tangents is None:
        tangents = np.empty((0, len(weights)), np.float32)
    values = inputs
    change = np.zeros((len(tangents), *inputs.shape), np.float32)
    start = 0
    for index, (rows, columns) in enumerate(SHAPES):
        if index:
            change *= values > 0.0
            values = np.maximum(values, 0.0)
        middle, end = start + rows * columns, start + (rows + 1) * columns
        matrix = weights[start:middle].reshape(rows, columns)
        turned = tangents[:, start:middle].reshape(-1, rows, columns)
        change = change @ matrix + values @ turned + tangents[:, None, middle:end]
        values = values @ matrix + weights[middle:end]
        start = end
    return values, change
