"""Sums of f_r over pairs of directions, as functions of the code, with derivatives."""

from __future__ import annotations

import numpy as np

from nacre.array import Doubles, Floats
from nacre.latent.directions import isotropic_inputs
from nacre.latent.neural_basis import BRIGHTEST, NeuralBasis
from nacre.neural.inputs import ENHANCED
from nacre.numerics.channels import CHROMA


class Sums:
    """n sums of f_r, each over r pairs of directions, for any code.

    Parameters
    ----------
    basis
        Of the codes.
    wi, wo
        Unit directions, shape (n, r, 3).
    weights
        Of f_r in each channel, shape (n, r, 3), or (n, r, 1) where all channels have the same.
    """

    def __init__(self, basis: NeuralBasis, wi: Floats, wo: Floats, weights: Floats) -> None:
        inputs = isotropic_inputs(wi.reshape(-1, 3), wo.reshape(-1, 3), ENHANCED)
        self._basis = basis
        self._values = basis.values(inputs).reshape(*wi.shape[:2], -1)
        self._weights = weights.astype(np.float32)

    def values(self, code: Doubles) -> Doubles:
        """The sums for a code, shape (n, 3)."""
        return np.asarray(self._reflected(code).sum(axis=1, dtype=np.float64))

    def at(self, code: Doubles) -> tuple[Doubles, Doubles]:
        """The sums for a code, shape (n, 3), and their derivatives by its values, (k, n, 3)."""
        reflected = self._reflected(code)
        by_function = (self._values.swapaxes(1, 2) @ reflected).transpose(1, 0, 2)
        luma, pairs = np.split(by_function[1:], [self._basis.luma])
        chroma = np.einsum("pnc,qc->pqnc", pairs, CHROMA).reshape(-1, *pairs.shape[1:])
        values = reflected.sum(axis=1, dtype=np.float64)
        return values, np.concatenate([luma, chroma]).astype(np.float64)

    def _reflected(self, code: Doubles) -> Floats:
        """What each pair adds, shape (n, r, 3)."""
        logarithms = self._values @ self._basis.channel_weights(code).astype(np.float32)
        return np.asarray(self._weights * np.exp(np.minimum(logarithms, BRIGHTEST)))
