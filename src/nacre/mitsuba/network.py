"""Networks in Mitsuba's kernels: which weights are literals, and which are data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.compile.data import with_numbers
from nacre.errors import require
from nacre.neural.network import NetworkBrdf
from nacre.numerics.mlp import Layer
from nacre.runtime.device import cooperative_type, matrix_views

WEIGHTS = "auto", "literals", "cooperative"
"""How weights enter a kernel; see :func:`nacre.mitsuba.bsdf`."""

MAX_LITERALS = 1 << 15
"""Up to this many weights, literals are the default: they render 1.6 (675 weights) to 3 times
(17,800 weights) as fast as data, but compile time grows with the square of their number. At 39,000
weights a first picture of 256 x 256 pixels and 8 samples takes equally long either way."""


def first_in_buffer(network: NetworkBrdf, weights: str) -> int:
    """Index of the first layer whose weights are data of the kernel; later layers are data, too.

    By default no layer is, up to :data:`MAX_LITERALS` weights. If materials share their first
    layers, only the others are data, so that one kernel renders all of these materials.
    """
    count = len(network.layers)
    if weights != "auto":
        return 0 if weights == "cooperative" else count
    literal = network.shared_layers or count
    sizes = (layer.weights.size for layer in network.layers[:literal])
    return literal if sum(sizes) <= MAX_LITERALS else 0


def takes_half(mi: Any) -> bool:
    """Whether a variant's cooperative vectors always have 16 bits, as on CUDA."""
    return cooperative_type(mi.Float) is not mi.Float


def pack_layers(mi: Any, layers: Sequence[Layer], half: bool, layout: str) -> list[tuple[Any, Any]]:
    """Matrix and bias of each layer as views into one new buffer, in a layout of `drjit.nn`."""
    tensor = mi.TensorXf16 if half else mi.TensorXf
    parts = [tensor(array) for y in layers for array in (y.weights.T.copy(), y.biases)]
    views = matrix_views(require("drjit.nn", "render").pack(*parts, layout=layout))
    return list(zip(views[::2], views[1::2], strict=True))


class BufferedNetwork:
    """A network whose last layers lie in one buffer of a JIT variant, as cooperative vectors.

    The buffer is an argument of every call, so that its owner may replace it and Dr.Jit can follow
    its gradients into virtual function calls. The first `start` layers are literals. If `half`, and
    always on CUDA, weights and hidden values of the others have 16 bits instead of 32.
    """

    def __init__(self, network: NetworkBrdf, mi: Any, start: int = 0, half: bool = False) -> None:
        self._network, self._mi, self._half = network, mi, half or takes_half(mi)
        self._literals = list(network.layers[:start])
        self._angle = opaque(mi, network.angle)
        self._nn = require("drjit.nn", "render")
        self._layers = pack_layers(mi, network.layers[start:], self._half, "training")

    def initial(self) -> Any:
        """The buffer that holds the weights of the network this was made from."""
        return self._layers[0][0].buffer

    def _bound(self, weights: Any) -> list[tuple[Any, Any]]:
        """Views of the layers into a buffer; made for each trace, which they must not outlive."""
        return [(self._view(w, weights), self._view(b, weights)) for w, b in self._layers]

    def _view(self, place: Any, weights: Any) -> Any:
        view = self._nn.MatrixView()
        for name in ("dtype", "layout", "shape", "stride", "offset", "size", "transpose"):
            setattr(view, name, getattr(place, name))
        view.buffer = weights
        return view

    def eval_components(self, weights: Any, wi: Components, wo: Components) -> Components:
        network = self._network
        values: Any = network.input_components(wi, wo, self._angle)
        values = network.through(values, self._literals) if self._literals else values
        values = self._nn.CoopVec(*values)
        if self._half:
            values = self._nn.cast(values, self._mi.Float16)
        outputs = network.through(values, self._bound(weights), len(self._literals))
        return network.from_outputs([self._mi.Float(v) for v in outputs])

    def layers(self, weights: Any) -> list[Layer]:
        """All layers as arrays, in whatever order the device stores those in the buffer."""
        flat = [view for layer in self._bound(weights) for view in layer]
        views = matrix_views(self._nn.unpack(*flat))
        arrays = [np.array(self._mi.TensorXf(view), np.float32) for view in views]
        return self._literals + [
            Layer(np.ascontiguousarray(matrix.T), bias.ravel())
            for matrix, bias in zip(arrays[::2], arrays[1::2], strict=True)
        ]


def opaque(mi: Any, parameters: Any) -> Any:
    """A sampler, or another dataclass, with numbers that are data of a kernel, not literals."""
    made = require("drjit", "render").opaque
    return with_numbers(parameters, lambda value: made(mi.Float, value))
