"""Many networks of 675 weights at once, in PyTorch."""

from __future__ import annotations

from typing import Any, TypeAlias

from nacre.errors import require
from nacre.latent.weights import SHAPES

torch: Any = require("torch", "latent")
Tensor: TypeAlias = Any

_LARGEST = 15.0
"""Outputs are clamped here while training: no material comes near e^15."""


def outputs(weights: Tensor, inputs: Tensor) -> Tensor:
    """Outputs of networks at the same inputs.

    Parameters
    ----------
    weights
        Shape (networks, 675), laid out as in :class:`nacre.latent.weights.WeightBasis`.
    inputs
        Shape (n, 6).

    Returns
    -------
    tensor of shape (networks, n, 3)
        ln(f_r + 1).
    """
    sizes = [part for rows, columns in SHAPES for part in (rows * columns, columns)]
    parts = weights.split(sizes, dim=1)
    values = inputs.expand(len(weights), -1, -1)
    for index, (rows, columns) in enumerate(SHAPES):
        if index:
            values = torch.relu(values)
        matrix = parts[2 * index].reshape(-1, rows, columns)
        values = torch.baddbmm(parts[2 * index + 1][:, None], values, matrix)
    return values


def reflectance(weights: Tensor, inputs: Tensor) -> Tensor:
    """f_r of networks in 1/sr as training sees it, not clamped at 0, shape (networks, n, 3)."""
    return outputs(weights, inputs).clamp(max=_LARGEST).exp() - 1.0
