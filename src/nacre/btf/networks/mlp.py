"""Fully connected layers with ReLUs between them, as named tensors."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.files import require

torch: Any = require("torch", "btf")
Tensor: TypeAlias = Any
Parameters: TypeAlias = Mapping[str, Tensor]
Shapes: TypeAlias = dict[str, tuple[int, ...]]
Layer: TypeAlias = tuple[Tensor, Tensor]
"""Weights, shape (inputs, outputs), and biases, shape (outputs,)."""


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
            values = values.relu()
    return values


def initial(shapes: Shapes, random: np.random.Generator) -> dict[str, npt.NDArray[np.float32]]:
    """Random weights and biases within 1 / sqrt(inputs of the layer), as PyTorch's layers have.

    Parameters
    ----------
    shapes
        Of tensors called `x.weight`, (inputs, outputs) or of a convolution (outputs, inputs, size),
        each followed by its `x.bias`.
    random
        Source of the numbers.
    """
    arrays, bound = {}, 0.0
    for name, shape in shapes.items():
        if name.endswith(".weight"):
            bound = 1.0 / math.sqrt(math.prod(shape[1:]) if len(shape) == 3 else shape[0])
        arrays[name] = random.uniform(-bound, bound, shape).astype(np.float32)
    return arrays
