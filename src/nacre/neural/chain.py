"""Networks that others made: any chain of dense layers and activations as a reflectance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from nacre.array import Array, Components, namespace
from nacre.brdf import Sampler
from nacre.geometry import half_difference, rusinkiewicz_angles
from nacre.neural.inputs import ENHANCED, network_inputs
from nacre.neural.network import NetworkBrdf
from nacre.numerics.activations import WITHOUT_VECTORS, applied, parsed
from nacre.numerics.mlp import Layer, dense, widths
from nacre.sampling.fit import LobeSampledBrdf

InputFunction = Callable[[Components, Components], Sequence[Array]]
"""What a network sees of unit directions (x, y, z) to the light and to the viewer."""


def _angles(wi: Components, wo: Components) -> Sequence[Array]:
    theta_h, _, theta_d, phi_d = rusinkiewicz_angles(wi, wo)
    return theta_h, theta_d, phi_d


def _vectors(wi: Components, wo: Components) -> Sequence[Array]:
    h, d = half_difference(wi, wo)
    return (*h, *d)


INPUTS: dict[str, tuple[int, bool, InputFunction]] = {
    "directions": (6, False, lambda wi, wo: (*wi, *wo)),
    "rusinkiewicz vectors": (6, False, _vectors),
    "rusinkiewicz angles": (3, True, _angles),
    "enhanced": (6, True, lambda wi, wo: network_inputs(wi, wo, True, ENHANCED)),
    "enhanced anisotropic": (8, False, lambda wi, wo: network_inputs(wi, wo, False, ENHANCED)),
}
"""Inputs by name: how many numbers, whether they make the network isotropic, and the function.

"directions" are those to the light and to the viewer; "rusinkiewicz vectors" the half vector h and
the difference vector d; "rusinkiewicz angles" theta_h, theta_d and phi_d in radians; "enhanced"
and "enhanced anisotropic" those of nacre's own fits, which open up highlights and grazing angles.
"""


class ChainBrdf(LobeSampledBrdf, NetworkBrdf):
    """Dense layers, each followed by an activation of its own, from inputs to f_r.

    Parameters
    ----------
    layers
        Dense layers from the inputs to 3 outputs, f_r in 1/sr.
    activations
        What follows each layer: names of :mod:`nacre.numerics.activations`, "" for nothing.
    inputs
        A name of :data:`INPUTS`, or a function of the two directions as components (x, y, z) to the
        light and to the viewer; files cannot hold a function.
    isotropic
        Whether f_r is unchanged when both directions turn about the normal; by default what the
        inputs say.
    name, source, sampler
        See :class:`nacre.brdf.Brdf`; without a sampler, lobes are fitted on first use.

    Raises
    ------
    ValueError
        If layers do not chain, or do not fit the inputs, or a name is not known.
    """

    def __init__(
        self,
        layers: Sequence[Layer],
        activations: Sequence[str],
        *,
        inputs: str | InputFunction = "directions",
        isotropic: bool | None = None,
        name: str = "",
        source: Mapping[str, str] | None = None,
        sampler: Sampler | None = None,
    ) -> None:
        super().__init__(name=name, source=source, sampler=sampler)
        self.layers, self.activations = tuple(layers), tuple(activations)
        self.seen = inputs
        self.inputs = inputs if isinstance(inputs, str) else "function"
        if isinstance(inputs, str) and inputs not in INPUTS:
            raise ValueError(f"inputs {inputs[:40]!r} are none of {', '.join(INPUTS)}")
        count, turns = INPUTS[inputs][:2] if isinstance(inputs, str) else (0, False)
        self.isotropic = turns if isotropic is None else isotropic
        sizes = widths(self.layers)
        names = [parsed(activation)[0] for activation in self.activations if activation]
        self.cooperative = not any(name in WITHOUT_VECTORS for name in names)
        if len(self.activations) != len(self.layers):
            raise ValueError(f"{len(self.layers)} layers have {len(self.activations)} activations")
        if sizes[-1] != 3 or (count and sizes[0] != count):
            expected = f"from {count or sizes[0]} inputs to 3 outputs"
            raise ValueError(f"a chain on {self.inputs} goes {expected}, not {sizes}")
        if not all(np.isfinite(array).all() for layer in self.layers for array in layer):
            raise ValueError("weights are not finite")

    @property
    def nbytes(self) -> int:
        return sum(layer.nbytes for layer in self.layers)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Width of every layer, inputs and outputs included."""
        return widths(self.layers)

    def with_layers(self, layers: Sequence[Layer]) -> ChainBrdf:
        """A network with other weights that is like this one in all else, lobes included."""
        made = ChainBrdf(
            layers,
            self.activations,
            inputs=self.seen,
            isotropic=self.isotropic,
            name=self.name,
            source=self.source,
            sampler=self.sampler,
        )
        return made.replaced(channels=self.channels, notes=self.notes)

    def input_components(self, wi: Components, wo: Components, angle: Any = 0.0) -> Any:
        function = INPUTS[self.seen][2] if isinstance(self.seen, str) else self.seen
        return list(function(wi, wo))

    def through(self, values: Any, layers: Sequence[Any], start: int = 0) -> Any:
        for layer, activation in zip(layers, self.activations[start:], strict=False):
            values = applied(activation, dense(values, layer))
        return values

    def from_outputs(self, values: Sequence[Array]) -> Components:
        # What overflows on its way may be no number.
        xp = namespace(*values)
        red, green, blue = (xp.where(value == value, value, 0.0) for value in values)
        return red, green, blue

    def describe(self) -> dict[str, Any]:
        return super().describe() | {
            "inputs": self.inputs,
            "layers": "-".join(map(str, self.sizes)),
            "activations": ", ".join(activation or "none" for activation in self.activations),
            "weights": sum(array.size for array in chain(*self.layers)),
            "sampler": str(self.sampler),
        }

    def summary(self) -> str:
        return f"{'-'.join(map(str, self.sizes))}, {self.inputs}, {super().summary()}"
