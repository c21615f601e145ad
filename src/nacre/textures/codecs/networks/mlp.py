"""Fully connected layers with ReLUs between them, as named tensors."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import require

torch: Any = require("torch", "btf")
Tensor: TypeAlias = Any
Parameters: TypeAlias = Mapping[str, Tensor]
Shapes: TypeAlias = dict[str, tuple[int, ...]]
Layer: TypeAlias = tuple[Tensor, Tensor]
"""Weights, shape (inputs, outputs), and biases, shape (outputs,)."""

VARIANCES = {"pytorch": 1.0, "he": math.sqrt(6.0)}
"""Ways to begin, and what multiplies 1 / sqrt(inputs) in the bound of weights; the variance of
uniform numbers is a third of the square of their bound."""


def mlp_shapes(name: str, widths: Sequence[int]) -> Shapes:
    """Names and shapes of the tensors of layers between `widths`."""
    shapes: Shapes = {}
    for index, (rows, columns) in enumerate(itertools.pairwise(widths)):
        shapes[f"{name}.{index}.weight"] = (rows, columns)
        shapes[f"{name}.{index}.bias"] = (columns,)
    return shapes


def mlp_layers(parameters: Parameters, name: str) -> list[Layer]:
    """The layers whose tensors :func:`mlp_shapes` has named."""
    found: list[Layer] = []
    while f"{name}.{len(found)}.weight" in parameters:
        start = f"{name}.{len(found)}"
        found.append((parameters[f"{start}.weight"], parameters[f"{start}.bias"]))
    return found


def run_mlp(values: Tensor, layers: Sequence[Layer]) -> Tensor:
    """Outputs for values of shape (n, inputs); the last layer is linear."""
    for index, (weight, bias) in enumerate(layers):
        values = torch.addmm(bias, values, weight)
        if index < len(layers) - 1:
            values = values.relu_()
    return values


def initial(
    shapes: Shapes, random: np.random.Generator, variance: str = "he"
) -> dict[str, npt.NDArray[np.float32]]:
    """Random weights and biases.

    Biases lie within 1 / sqrt(inputs of the layer), weights within that times a factor.

    Parameters
    ----------
    shapes
        Of tensors called `x.weight`, (inputs, outputs) or of a convolution (outputs, inputs, size),
        each followed by its `x.bias`.
    random
        Source of the numbers.
    variance
        Of the weights, one of :data:`VARIANCES`: "pytorch" as layers of PyTorch have it, a third of
        1 / inputs; "he" with 2 / inputs, so that the variance of signals stays through layers with
        ReLUs (He et al. 2015).
    """
    arrays, bound = {}, 0.0
    for name, shape in shapes.items():
        factor = 1.0
        if name.endswith(".weight"):
            bound = 1.0 / math.sqrt(math.prod(shape[1:]) if len(shape) == 3 else shape[0])
            factor = VARIANCES[variance]
        arrays[name] = random.uniform(-factor * bound, factor * bound, shape).astype(np.float32)
    return arrays
