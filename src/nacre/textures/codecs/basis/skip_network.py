"""A linear map with a small network beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.numerics.mlp import Layer
from nacre.textures.codecs.basis.functions import silu


@dataclass(frozen=True, eq=False)
class SkipNetwork:
    """x @ linear + network(x): what is nearly linear needs no more than a small network.

    Parameters
    ----------
    linear
        Shape (inputs, outputs).
    layers
        Of the network; all but the last are followed by x / (1 + exp(-x)). It may see more inputs
        than the linear map, see :meth:`given`.

    Raises
    ------
    ValueError
        If the layers do not chain from the inputs to the outputs.
    """

    linear: Floats
    layers: Sequence[Layer]

    def __post_init__(self) -> None:
        inputs, outputs = self.linear.shape
        width = max(inputs, len(self.layers[0].weights)) if self.layers else inputs
        for layer in self.layers:
            if layer.weights.shape != (width, len(layer.biases)):
                raise ValueError(f"a layer of shape {layer.weights.shape} follows {width} values")
            width = len(layer.biases)
        if len(self.layers) < 2 or width != outputs:
            raise ValueError(f"layers end in {width} values, the linear map in {outputs}")

    def given(self, further: Floats) -> SkipNetwork:
        """The network with the inputs that the linear map does not see held fixed."""
        first, *others = self.layers
        inputs = len(self.linear)
        biases = np.asarray(first.biases + further @ first.weights[inputs:], np.float32)
        return SkipNetwork(self.linear, [Layer(first.weights[:inputs], biases), *others])

    def __call__(self, x: Floats) -> Floats:
        """Outputs (b, outputs) of inputs (b, inputs)."""
        *hidden, last = self.layers
        state = x
        for layer in hidden:
            state = silu(state @ layer.weights + layer.biases)
        result: Floats = x @ self.linear + state @ last.weights + last.biases
        return result

    def jacobian(self, x: Floats) -> tuple[Floats, Floats]:
        """Outputs (b, outputs), and their derivatives by the inputs (b, inputs, outputs)."""
        *hidden, last = self.layers
        first, *others = hidden
        state, slope = _silu_and_slope(x @ first.weights + first.biases)
        change: Floats = first.weights * slope[:, None]
        for layer in others:
            state, slope = _silu_and_slope(state @ layer.weights + layer.biases)
            change = _rows_times(change, layer.weights) * slope[:, None]
        value = x @ self.linear + state @ last.weights + last.biases
        slopes = _rows_times(change, last.weights)
        slopes += self.linear
        return value, slopes


def _rows_times(many: Floats, matrix: Floats) -> Floats:
    """Matrices (b, k, m) times one, as a single product."""
    count, rows, inputs = many.shape
    product: Floats = many.reshape(count * rows, inputs) @ matrix
    return product.reshape(count, rows, matrix.shape[1])


def _silu_and_slope(x: Floats) -> tuple[Floats, Floats]:
    sigmoid = 1.0 / (1.0 + np.exp(-np.clip(x, -60.0, 60.0)))
    value = x * sigmoid
    return value, sigmoid + value * (1.0 - sigmoid)
