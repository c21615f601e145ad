"""Networks that are reciprocal, positive, and reflect no more light than they get.

Reciprocity comes from the inputs (:func:`nacre.neural.inputs.network_inputs`, "reciprocal"), and
f_r = exp(x) is positive whatever the outputs x are. Energy is limited in two steps. Training is on
the projection of the material (:mod:`nacre.sampling.projection`): the mean of both orders of light
and view, darkened smoothly towards those views from which it would give back too much. What the
trained network still has above 1 is removed by one factor, a shift of its last biases, and the
largest albedo is certified (:func:`certify`).
"""

from __future__ import annotations

import math

import numpy as np

from nacre.neural.nbrdf import PRECISIONS, NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling.energy import Certificate, certify

_TARGET = 0.9999  # of the bound after the factor, so that rounding cannot lift it above 1


def limited(network: NeuralBrdf) -> NeuralBrdf:
    """A physical network times the factor, at most 1, that keeps its albedo at 1 or below.

    Its metadata say under "physical" what was certified: "largest_albedo", "albedo_bound", and the
    "factor".
    """
    found, factor = certify(network), 1.0
    if found.bound > 1.0:
        network, factor = _scaled(network, _TARGET / found.bound)
        found = Certificate(factor * found.largest, factor * found.bound)
    facts = {"largest_albedo": found.largest, "albedo_bound": found.bound, "factor": factor}
    return network.replaced(metadata={**network.metadata, "physical": facts})


def _scaled(network: NeuralBrdf, factor: float) -> tuple[NeuralBrdf, float]:
    """A network times a factor, or slightly less where its precision has no such biases; and the
    largest factor of a channel.
    """
    *hidden, last = network.layers
    kind = PRECISIONS[network.precision]
    exact = last.biases.astype(float) + math.log(factor)
    biases = exact.astype(kind)
    biases = np.where(biases > exact, np.nextafter(biases, kind.type(-np.inf)), biases)
    shift = biases.astype(float) - last.biases
    return network.with_layers([*hidden, Layer(last.weights, biases)]), math.exp(shift.max())
