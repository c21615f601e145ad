"""Codes that are optimized for what pictures show."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.latent.pca import EPSILON, Basis, node_cosines
from nacre.numerics.least_absolute import minimize

GAIN = 30.0
"""k of the loss."""
_NODES = 10_000
"""Nodes drawn: a code has a few dozen values."""
_STEPS = 50

Vector = npt.NDArray[np.float64]


def optimised(basis: Basis, brdf: Brdf, gain: float = GAIN, seed: int = 0) -> Vector:
    """The code that comes closest in log(1 + k f cos theta_i).

    The projection is closest in the logarithm of f w, which counts what is dark as much as what is
    bright. From there the mean absolute difference of log(1 + k f cos theta_i) is brought to a
    minimum over nodes drawn uniformly in the Rusinkiewicz angles.

    Parameters
    ----------
    basis
        Of the code.
    brdf
        Isotropic.
    gain
        k.
    seed
        Of the nodes: the same seed gives the same code.

    Returns
    -------
    array of shape (k,)
        In standard deviations of the training materials.

    Raises
    ------
    FormatError
        If `brdf` is anisotropic.
    NacreError
        If it is known at none of the nodes, or too unlike the training materials.
    """
    start = basis.project(brdf)
    values, known = basis.values(brdf)
    # Rows of nodes lie at squares of equal steps: the angle that one stands for grows with them.
    row = np.nonzero(basis.mask)[0]
    chance = known * (row + 0.5)
    drawn = np.random.default_rng(seed).choice(len(row), _NODES, p=chance / chance.sum())
    cosine = node_cosines(basis.resolution)[0][basis.mask][drawn]
    weights = basis.weights()[drawn]
    target = np.log1p(gain * values[drawn] * cosine[:, None])
    slope = gain * cosine / weights
    directions = basis.components[:, drawn].T[:, basis.uses] * basis.deviations
    colours = basis.colours.T.astype(np.float64)

    def scaled(code: Vector) -> Vector:
        """The product k (f w + e) cos theta_i / w, shape (drawn, 3)."""
        grown: Vector = np.exp(basis.logarithms(code, drawn).astype(np.float64))
        return grown * slope[:, None]

    def residuals(code: Vector) -> Vector:
        above = np.maximum(scaled(code) - EPSILON * slope[:, None], 0.0)
        difference: Vector = np.log1p(above) - target
        return difference

    def jacobian(code: Vector, _: Vector) -> Vector:
        grown = scaled(code)
        rate = grown / (1.0 + np.maximum(grown - EPSILON * slope[:, None], 0.0))
        rows: Vector = np.einsum("nk,nc,ck->knc", directions, rate, colours, optimize=True)
        return rows

    with np.errstate(over="ignore", invalid="ignore"):
        return minimize(residuals, jacobian, start, _STEPS)[0]
