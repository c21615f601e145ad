"""What reflectances have in common that are chains of layers on a pair of directions."""

from __future__ import annotations

import abc
from collections.abc import Sequence

from nacre.array import Array, Components
from nacre.brdf import Brdf
from nacre.neural.inputs import network_inputs
from nacre.numerics.mlp import RELU, Layer, forward


class NetworkBrdf(Brdf):
    """A network: dense layers from a parametrization of the directions to f_r of every channel.

    Renderers may hold the weights in a buffer, so that one kernel serves all networks of the same
    :attr:`layers`' sizes.
    """

    layers: Sequence[Layer]
    """Dense layers from the inputs to 3 outputs."""
    inputs: str
    """Name of the parametrization; see :func:`nacre.neural.inputs.network_inputs`."""

    activation: str = RELU
    """What follows each layer but the last: :data:`nacre.numerics.mlp.RELU` or `SQUARED_RELU`."""

    shared_layers: int = 0
    """How many of the first layers are the same in all materials of a family."""

    @abc.abstractmethod
    def from_outputs(self, values: Sequence[Array]) -> Components:
        """f_r in 1/sr of the 3 outputs of the last layer."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`; weights enter a Dr.Jit kernel as literals."""
        inputs = network_inputs(wi, wo, self.isotropic, self.inputs)
        return self.from_outputs(forward(inputs, self.layers, self.activation))
