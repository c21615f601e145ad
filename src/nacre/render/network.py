"""A network on Dr.Jit's cooperative vectors: weights that change without recompiling."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.errors import require
from nacre.neural.inputs import network_inputs
from nacre.neural.nbrdf import NeuralBrdf
from nacre.numerics.mlp import Layer


def pack_layers(mi: Any, layers: Sequence[Layer], half: bool, layout: str) -> list[tuple[Any, Any]]:
    """Matrix and bias of each layer as views into one new buffer, in a layout of `drjit.nn`."""
    tensor = mi.TensorXf16 if half else mi.TensorXf
    parts = [tensor(array) for y in layers for array in (y.weights.T.copy(), y.biases)]
    views = require("drjit.nn", "render").pack(*parts, layout=layout)
    return list(zip(views[::2], views[1::2], strict=True))


class CooperativeNetwork:
    """The layers of an NBRDF as one buffer of a JIT variant.

    The buffer is passed to every call instead of being kept, so that its owner may replace it and
    Dr.Jit can follow its gradients into virtual function calls.

    Parameters
    ----------
    brdf
        The network.
    mi
        The `mitsuba` module with a JIT variant set.
    half
        Whether weights and hidden values have 16 bits instead of 32.
    """

    def __init__(self, brdf: NeuralBrdf, mi: Any, half: bool = False) -> None:
        self._brdf, self._mi, self._half = brdf, mi, half
        self._nn = require("drjit.nn", "render")
        self._type = mi.Float16 if half else mi.Float
        self._layers = pack_layers(mi, brdf.layers, half, "training")

    def initial(self) -> Any:
        """The buffer that holds the weights of the network this was made from."""
        return self._layers[0][0].buffer

    def _bound(self, weights: Any) -> list[list[Any]]:
        """Views of the layers into a buffer, made anew: none outlives the trace that it is for."""
        return [[self._view(place, weights) for place in layer] for layer in self._layers]

    def _view(self, place: Any, weights: Any) -> Any:
        view = self._nn.MatrixView()
        for name in ("dtype", "layout", "shape", "stride", "offset", "size", "transpose"):
            setattr(view, name, getattr(place, name))
        view.buffer = weights
        return view

    def eval_components(self, weights: Any, wi: Components, wo: Components) -> Components:
        """What :meth:`nacre.neural.NeuralBrdf.eval_components` does, with the given weights."""
        drjit = require("drjit", "render")
        brdf = self._brdf
        values = self._nn.CoopVec(*network_inputs(wi, wo, brdf.isotropic, brdf.inputs))
        if self._half:
            values = self._nn.cast(values, self._mi.Float16)
        for index, (matrix, bias) in enumerate(self._bound(weights)):
            if index:
                values = drjit.maximum(values, 0.0)
            values = self._nn.matvec(matrix, values, bias)
        red, green, blue = (drjit.exp(self._mi.Float(v)) - 1.0 for v in values)
        return red, green, blue

    def layers(self, weights: Any) -> list[Layer]:
        """A buffer of weights as layers, whatever the order in which this device stores them."""
        flat = [view for layer in self._bound(weights) for view in layer]
        arrays = [np.array(self._mi.TensorXf(view), np.float32) for view in self._nn.unpack(*flat)]
        return [
            Layer(np.ascontiguousarray(matrix.T), bias.ravel())
            for matrix, bias in zip(arrays[::2], arrays[1::2], strict=True)
        ]
