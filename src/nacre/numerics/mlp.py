"""Small multilayer perceptrons: their layers, and one forward pass for every array library.

Rows of NumPy arrays, tensors of PyTorch, components of any library (see :mod:`nacre.array`) and
Dr.Jit's cooperative vectors all go through :func:`forward`; a layer is a pair of weights (inputs,
outputs) and biases (outputs,) of the same library. Where a network is more than a chain, with sums
around layers for instance, :func:`dense` is one step of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Floats, Weights, namespace

RELU, TANH = "relu", "tanh"
SQUARED_RELU = "squared relu"  # max(x, 0)^2: smooth, for one more multiplication
SILU = "silu"  # x / (1 + exp(-x)), also known as swish
SILU_BY_TANH = "silu by tanh"  # the same as x / 2 (1 + tanh(x / 2)), whose last bits differ

_CLIP = 60.0  # bound of the exponent of SILU: exp does not overflow float32


@dataclass(frozen=True, eq=False)
class Layer:
    """One dense layer: `inputs @ weights + biases`, kept as float32. Unpacks into the two."""

    weights: Weights  # shape (inputs, outputs)
    biases: Weights  # shape (outputs,)

    def __post_init__(self) -> None:
        for name in ("weights", "biases"):
            with np.errstate(over="ignore"):  # readers refuse what is not finite
                array = np.ascontiguousarray(getattr(self, name), np.float32)
            object.__setattr__(self, name, array)
        shape = self.weights.shape
        if len(shape) != 2 or 0 in shape or self.biases.shape != shape[1:]:
            raise ValueError(f"weights {shape} and biases {self.biases.shape} are not a layer")

    def __iter__(self) -> Iterator[Weights]:
        return iter((self.weights, self.biases))

    @property
    def nbytes(self) -> int:
        return self.weights.nbytes + self.biases.nbytes


AnyLayer: TypeAlias = Layer | tuple[Any, Any]


def widths(layers: Sequence[Layer]) -> tuple[int, ...]:
    """Inputs of the first layer, then the outputs of each.

    Raises ValueError if there is no layer, or the layers do not chain.
    """
    if not layers:
        raise ValueError("a network has at least one layer")
    found = (len(layers[0].weights), *(len(layer.biases) for layer in layers))
    if found[:-1] != tuple(len(layer.weights) for layer in layers):
        raise ValueError(f"layers do not chain: {[layer.weights.shape for layer in layers]}")
    return found


def flat_weights(layers: Sequence[Layer]) -> Weights:
    """The weights of all layers one after the other: each matrix by rows, then its biases."""
    return np.concatenate([array.reshape(-1) for layer in layers for array in layer])


def shaped_layers(weights: npt.ArrayLike, shapes: Sequence[tuple[int, int]]) -> list[Layer]:
    """The layers of :func:`flat_weights`, from the inputs and outputs of each."""
    left = np.asarray(weights, np.float32)
    layers = []
    for rows, columns in shapes:
        matrix, biases, left = np.split(left, [rows * columns, (rows + 1) * columns])
        layers.append(Layer(matrix.reshape(rows, columns), biases))
    return layers


def forward(values: Any, layers: Sequence[AnyLayer], activation: str = RELU) -> Any:
    """Outputs of a network.

    `values` are the inputs: a NumPy array or tensor of shape (..., inputs), a sequence of one array
    or number per input, or a cooperative vector; so are the outputs. The activation, :data:`RELU`,
    :data:`SQUARED_RELU`, :data:`TANH`, :data:`SILU` or :data:`SILU_BY_TANH`, follows each layer but
    the last.
    """
    *hidden, last = layers
    for layer in hidden:
        values = dense(values, layer, activation)
    return dense(values, last)


def dense(values: Any, layer: AnyLayer, activation: str | None = None) -> Any:
    """One layer, and the activation after it; see :func:`forward`.

    Tensors may belong to many networks at once: values (networks, n, inputs), weights (networks,
    inputs, outputs) and biases (networks, outputs).
    """
    product, functions = _library(values)
    result = product(values, *layer)
    return result if activation is None else functions[activation](result)


def activate(values: Any, activation: str) -> Any:
    """An activation of :func:`forward` applied to the values before it."""
    return _library(values)[1][activation](values)


_Functions: TypeAlias = dict[str, Callable[[Any], Any]]


def _library(values: Any) -> tuple[Callable[[Any, Any, Any], Any], _Functions]:
    """The product with a layer, and the activations by name, for the library of some values."""
    if isinstance(values, np.ndarray):
        return _rows, _NUMPY
    if isinstance(values, list | tuple):
        return _components, _COMPONENTS
    if type(values).__module__.partition(".")[0] == "torch":
        return _tensors, _TORCH
    return _cooperative, _COOPERATIVE


def _rows(values: Floats, weights: Floats, biases: Floats) -> Floats:
    return values @ weights.astype(values.dtype, copy=False) + biases


def silu(x: Floats) -> Floats:
    return x / (1.0 + np.exp(-np.clip(x, -_CLIP, _CLIP)))


def _silu_by_tanh(x: Floats) -> Floats:
    return np.asarray(0.5 * x * (1.0 + np.tanh(0.5 * x)))


_NUMPY: _Functions = {
    RELU: lambda x: np.maximum(x, 0.0),
    SQUARED_RELU: lambda x: np.maximum(x, 0.0) * x,
    TANH: np.tanh,
    SILU: silu,
    SILU_BY_TANH: _silu_by_tanh,
}


def _components(values: Sequence[Array], weights: Any, biases: Any) -> list[Array]:
    return namespace(*values).dense(values, weights, biases)


def _relu_components(values: Sequence[Array]) -> list[Array]:
    xp = namespace(*values)
    return [xp.maximum(v, 0.0) for v in values]


def _squared_relu_components(values: Sequence[Array]) -> list[Array]:
    xp = namespace(*values)
    return [xp.maximum(v, 0.0) * v for v in values]


_COMPONENTS: _Functions = {RELU: _relu_components, SQUARED_RELU: _squared_relu_components}


def _tensors(values: Any, weights: Any, biases: Any) -> Any:
    import torch

    if weights.ndim == 3:
        return torch.baddbmm(biases[:, None], values, weights)
    return torch.addmm(biases, values, weights) if values.ndim == 2 else values @ weights + biases


def _silu_tensor(values: Any) -> Any:
    import torch

    return torch.nn.functional.silu(values)


_TORCH: _Functions = {
    RELU: lambda x: x.relu_(),
    SQUARED_RELU: lambda x: x.relu_().square(),
    TANH: lambda x: x.tanh(),
    SILU: _silu_tensor,
}


def _cooperative(values: Any, weights: Any, biases: Any) -> Any:
    from drjit import nn

    return nn.matvec(weights, values, biases)


def _relu_cooperative(values: Any) -> Any:
    import drjit

    return drjit.maximum(values, 0.0)


def _squared_relu_cooperative(values: Any) -> Any:
    return _relu_cooperative(values) * values


def _silu_cooperative(values: Any) -> Any:
    """By way of tanh: these vectors have no other function with an exponential."""
    import drjit

    half = values * 0.5
    return drjit.fma(half, drjit.tanh(half), half)


_COOPERATIVE: _Functions = {
    RELU: _relu_cooperative,
    SQUARED_RELU: _squared_relu_cooperative,
    SILU: _silu_cooperative,
}
