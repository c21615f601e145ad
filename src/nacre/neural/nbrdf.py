"""The NBRDF: a reflectance as a small multilayer perceptron on Rusinkiewicz vectors.

NBRDF paper, section 3.1 and Figure 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from nacre.array import Array, Components, namespace
from nacre.brdf import Sampler
from nacre.geometry import broadcast_shape
from nacre.neural.inputs import (
    LARGEST_INPUT,
    PAPER,
    RECIPROCAL,
    has_axes,
    input_count,
    rotates_half_vector,
)
from nacre.neural.network import NetworkBrdf, fit_facts, loss_text
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer, widths

OUTPUTS = 3
_LARGEST_SUM = 1e37
_LARGEST_EXPONENT = 80.0  # e^x of it is finite in float32
HIDDEN = (21, 21)  # hidden layer sizes of the paper: 675 weights
SINGLE, HALF = "single", "half"
PRECISIONS: dict[str, np.dtype[Any]] = {SINGLE: np.dtype(np.float32), HALF: np.dtype(np.float16)}
"""How weights are stored, by name; computations are in single precision."""
ACTIVATIONS = RELU, SQUARED_RELU
"""What follows hidden layers: the paper's, and a smooth one."""


def round_layers(layers: Sequence[Layer], precision: str) -> list[Layer]:
    """Layers with the nearest weights that a precision of :data:`PRECISIONS` stores."""
    kind = PRECISIONS[precision]
    largest = np.finfo(kind).max
    return [Layer(*(np.clip(a, -largest, largest).astype(kind) for a in x)) for x in layers]


def check_weights(layers: Sequence[Layer], activation: str = RELU) -> None:
    """Raise ValueError for weights that are not finite, or whose sums could overflow float32."""
    bound = np.full(len(layers[0].weights), LARGEST_INPUT) if layers else np.ones(1)
    with np.errstate(over="ignore", invalid="ignore"):
        for layer in layers:
            weights, biases = (np.abs(a.astype(np.float64)) for a in layer)
            if not (np.isfinite(weights).all() and np.isfinite(biases).all()):
                raise ValueError("weights are not finite")
            if len(bound) == len(weights):
                bound = bound @ weights + biases
                if activation == SQUARED_RELU and layer is not layers[-1]:
                    bound = np.square(bound)
            if not bound.max() < _LARGEST_SUM:
                raise ValueError("weights are so large that sums of them overflow")


class NeuralBrdf(NetworkBrdf):
    """An NBRDF: a pair of directions through dense layers to exp(x) - 1 per color channel.

    Parameters
    ----------
    layers
        Dense layers from the inputs (see :func:`nacre.neural.inputs.network_inputs`) to 3 outputs.
    isotropic
        Whether h is rotated to phi_h = 0.
    name, source, sampler
        See :class:`nacre.brdf.Brdf`.
    metadata
        JSON-able facts about the fit and its source, kept in the file.
    inputs
        Name of the parametrization of the inputs; "paper" is (h, d).
    precision
        How a file stores the weights, one of :data:`PRECISIONS`, which must hold them exactly.
    activation
        What follows each layer but the last, one of :data:`ACTIVATIONS`.
    angle
        Azimuth of the axis that the inputs take for x, in radians, in [0, pi/2); 0 unless they have
        axes (:func:`nacre.neural.inputs.has_axes`).
    """

    isotropy_known = True

    def __init__(
        self,
        layers: Sequence[Layer],
        *,
        isotropic: bool = True,
        name: str = "",
        source: Mapping[str, str] | None = None,
        sampler: Sampler | None = None,
        metadata: Mapping[str, Any] | None = None,
        inputs: str = PAPER,
        precision: str = SINGLE,
        activation: str = RELU,
        angle: float = 0.0,
    ) -> None:
        super().__init__(name=name, source=source, sampler=sampler)
        self.layers, self.isotropic = tuple(layers), isotropic
        self.metadata: Mapping[str, Any] = dict(metadata or {})
        self.inputs, self.precision = inputs, precision
        self.activation, self.angle = activation, angle
        self.physical = inputs == RECIPROCAL
        sizes = self.sizes
        if self.precision not in PRECISIONS:
            raise ValueError(f"unknown precision {self.precision!r}")
        if self.activation not in ACTIVATIONS:
            raise ValueError(f"unknown activation {self.activation!r}")
        rounded = round_layers(self.layers, self.precision)
        pairs = zip(chain(*self.layers), chain(*rounded), strict=True)
        if not all(np.array_equal(a, b, equal_nan=True) for a, b in pairs):
            raise ValueError(f"{self.precision} precision does not hold these weights")
        if self.isotropic and not rotates_half_vector(self.inputs, True):
            raise ValueError(f"a network with {self.inputs} inputs is not isotropic")
        if not 0.0 <= self.angle < 0.5 * math.pi:
            raise ValueError(f"the angle of the axes lies in [0, pi/2), not at {self.angle}")
        if self.angle and not has_axes(self.inputs, self.isotropic):
            raise ValueError(f"{self.inputs} inputs have no axes that could lie at an angle")
        count = input_count(self.inputs, self.isotropic)
        if (sizes[0], sizes[-1]) != (count, OUTPUTS):
            raise ValueError(f"this NBRDF goes from {count} inputs to {OUTPUTS} outputs: {sizes}")

    @property
    def sizes(self) -> tuple[int, ...]:
        """Width of every layer, inputs and outputs included: (6, 21, 21, 3)."""
        return widths(self.layers)

    @property
    def weight_count(self) -> int:
        """Number of weights and biases."""
        return sum(array.size for array in chain(*self.layers))

    @property
    def nbytes(self) -> int:
        return PRECISIONS[self.precision].itemsize * self.weight_count

    def summary(self) -> str:
        sizes = "-".join(map(str, self.sizes))
        return f"{sizes}, {self.inputs} inputs, {super().summary()}"

    def loss_text(self) -> str:
        """See :func:`nacre.neural.network.loss_text`."""
        return loss_text(self.metadata)

    def with_layers(self, layers: Sequence[Layer]) -> NeuralBrdf:
        """A network with other layers that is like this one in all else."""
        kept = "isotropic", "name", "source", "sampler", "metadata", "inputs", "precision"
        settings = {name: getattr(self, name) for name in (*kept, "activation", "angle")}
        network = NeuralBrdf(layers, **settings)
        return network.replaced(channels=self.channels, notes=self.notes)

    def _eval_followed(self, wi: Array, wo: Array) -> Array:
        if namespace(wi).library != "torch":
            return super()._eval_followed(wi, wo)
        from nacre.neural.torch_layers import constant_layers, evaluated

        shape = broadcast_shape(wi=wi, wo=wo)
        wi, wo = (w.expand(shape).reshape(1, math.prod(shape[:-1]), 3) for w in (wi, wo))
        layers = constant_layers(self, wi.device)
        return evaluated(self, layers, wi, wo, self.angle).reshape(shape)

    def from_outputs(self, values: Sequence[Array]) -> Components:
        xp = namespace(*values)
        if self.physical:
            red, green, blue = (xp.exp(xp.minimum(v, _LARGEST_EXPONENT)) for v in values)
            return red, green, blue
        red, green, blue = (xp.exp(v) - 1.0 for v in values)
        return red, green, blue

    def describe(self) -> dict[str, Any]:
        own = {
            "inputs": self.inputs,
            "activation": self.activation,
            "angle of the axes": round(math.degrees(self.angle), 3) if self.angle else None,
            "layers": "-".join(map(str, self.sizes)),
            "weights": self.weight_count,
            "sampler": str(self.sampler),
        }
        return super().describe() | fit_facts(self.metadata, own)
