"""What reflectances that are chains of layers on a pair of directions have in common."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any

from nacre.array import Array, Components
from nacre.brdf import Brdf
from nacre.neural.inputs import network_inputs
from nacre.numerics.direction_samples import loss_scale
from nacre.numerics.mlp import RELU, Layer, dense


class NetworkBrdf(Brdf):
    """A network: dense layers from a parametrization of the directions to f_r of every channel.

    Renderers may hold the weights in a buffer, so that one kernel serves all networks whose
    :attr:`layers` have the same sizes.
    """

    layers: Sequence[Layer]
    """Dense layers from the inputs to 3 outputs."""
    inputs: str
    """Name of the parametrization; see :func:`nacre.neural.inputs.network_inputs`."""

    activation: str = RELU
    """What follows each layer but the last: :data:`nacre.numerics.mlp.RELU` or `SQUARED_RELU`."""

    angle: float = 0.0  # azimuth of the axis that the inputs take for x, in radians

    cooperative: bool = True
    """Whether Dr.Jit's cooperative vectors have all of its activations."""

    shared_layers: int = 0  # how many of the first layers all materials of a family share

    @property
    def weights(self) -> tuple[Any, ...]:
        """Weights of every layer, shape (inputs, outputs) each, as they are stored."""
        return tuple(layer.weights for layer in self.layers)

    @property
    def biases(self) -> tuple[Any, ...]:
        """Biases of every layer, shape (outputs,) each."""
        return tuple(layer.biases for layer in self.layers)

    @abc.abstractmethod
    def from_outputs(self, values: Sequence[Array]) -> Components:
        """f_r in 1/sr from the 3 outputs of the last layer."""

    def input_components(self, wi: Components, wo: Components, angle: Any) -> Any:
        """What the first layer takes; the angle is :attr:`angle`, or data in its place."""
        return network_inputs(wi, wo, self.isotropic, self.inputs, angle)

    def through(self, values: Any, layers: Sequence[Any], start: int = 0) -> Any:
        """Outputs of some layers, the first of which is the one of that index."""
        last = len(self.layers) - 1
        for index, layer in enumerate(layers, start):
            values = dense(values, layer, self.activation if index < last else None)
        return values

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`; weights enter a Dr.Jit kernel as literals."""
        inputs = self.input_components(wi, wo, self.angle)
        return self.from_outputs(self.through(inputs, self.layers))


def loss_text(metadata: Mapping[str, Any]) -> str:
    """The loss of a fit with its scale, "held-out loss 0.00312 (log(1 + 32 f cos))", or ""."""
    loss = metadata.get("quality", {}).get("held_out_loss")
    if not isinstance(loss, float):
        return ""
    return f"held-out loss {loss:.5f} ({loss_scale(metadata.get('fit', {}).get('gain'))})"


def fit_facts(metadata: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Facts of a network's own, then what its metadata say of its source and its fit."""
    source, fit = metadata.get("source", {}), metadata.get("fit", {})
    facts = {
        **own,
        "fitted to": source.get("file"),
        "fitted to sha256": source.get("sha256"),
        "terms of the source": source.get("terms"),
        "loss": loss_scale(fit.get("gain")) if loss_text(metadata) else None,
        **metadata.get("quality", {}),
        **{f"fit {key}": value for key, value in fit.items()},
    }
    return {key.replace("_", " "): value for key, value in facts.items() if value is not None}
