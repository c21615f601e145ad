"""Codes of materials in bases whose codes stand for networks of 675 weights."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.latent.directions import isotropic_inputs
from nacre.latent.picture_errors import PictureErrors
from nacre.latent.weights import FARTHEST, SHAPES, Matrix, WeightBasis, shortened
from nacre.neural.inputs import PAPER
from nacre.numerics.least_absolute import minimize

_STEPS = 8
_DIFFERENCE = 1e-4
"""Change of a value by which its effect on the weights is found."""
_LARGEST = 30.0
"""Bound of ln(f_r + 1) while a code is sought."""

Floats = npt.NDArray[np.float32]


def refine(basis: WeightBasis, errors: PictureErrors, start: npt.ArrayLike, prior: float) -> Matrix:
    """The code whose network comes closest to an isotropic material, near a start.

    The sum of the absolute errors and of the absolute values of the code is brought to a minimum.

    Parameters
    ----------
    basis
        What the code is for.
    errors
        From the material.
    start
        Code to begin at, shape (k,).
    prior
        Weight of the absolute values of the code.

    Returns
    -------
    array of shape (k,)
    """
    inputs = isotropic_inputs(errors.wi, errors.wo, PAPER)
    pull = prior * np.eye(len(basis))

    def residuals(code: Matrix) -> Matrix:
        weights = basis.weights(shortened(code)[None])[0].astype(np.float32)
        f_r = np.expm1(np.minimum(_outputs(weights, inputs)[0], _LARGEST))
        return np.concatenate([errors.errors(f_r), prior * code])

    def jacobian(code: Matrix, _: Matrix) -> Matrix:
        weights = basis.weights(shortened(code)[None])[0].astype(np.float32)
        y, tangents = _outputs(weights, inputs, weight_tangents(basis, code).astype(np.float32))
        grown = np.exp(np.minimum(y, _LARGEST))
        rates = tangents * ((y < _LARGEST) * grown)
        return np.concatenate([errors.slopes(grown - 1.0, rates), pull], axis=1)

    limit = FARTHEST * np.sqrt(len(basis))
    return minimize(residuals, jacobian, np.asarray(start, np.float64), _STEPS, limit)[0]


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
