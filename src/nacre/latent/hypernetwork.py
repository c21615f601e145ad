"""A network that turns codes of a neural basis into ordinary networks of 675 weights.

A code of a :class:`nacre.latent.neural_basis.NeuralBasis` weighs functions, and what it stands for
takes the whole basis to evaluate. The hypernetwork gives a network of a thirtieth of the size that
comes close to it, for any code.

Colors go by channel as they do there. What hidden layers are depends on the gray values, and on
the squared lengths of the pairs, which permutations of the channels do not change. The weights of
an output depend on these and on what the pairs say of its own channel, in the same way for all
three. So a permutation of the channels of a material is one of its code here too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.weights import COUNT, SIZES, Matrix, WeightBasis, bent, dense
from nacre.neural.nbrdf import OUTPUTS
from nacre.numerics.channels import CHROMA
from nacre.numerics.mlp import Layer

COLUMN = SIZES[-2] + 1
"""Weights and bias of one output."""
HIDDEN_COUNT = COUNT - OUTPUTS * COLUMN
"""Weights and biases of the hidden layers."""


@dataclass(frozen=True, eq=False)
class Hypernetwork(WeightBasis):
    """Four layers from a code to the weights of a network, about the basis that has the code.

    With s(x) = x / (1 + e^-x), gray values g, pairs p and their share c of a channel:

    - u = s(trunk of (g, |p|^2 / 2 - 1)),
    - weights of the hidden layers: shared of (g, u),
    - weights and bias of the channel's output: output of (g, c, s(channel of (u, c))).

    Parameters
    ----------
    basis
        Whose codes these are; what :func:`nacre.latent.encode` starts from.
    trunk, shared, channel, output
        The layers.
    metadata
        JSON-able facts about the training.

    Raises
    ------
    ValueError
        If layers do not fit to one another.
    """

    LAYERS = "trunk", "shared", "channel", "output"

    basis: NeuralBasis
    trunk: Layer
    shared: Layer
    channel: Layer
    output: Layer
    metadata: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        greys, pairs, width = self.basis.greys, self.pairs, len(self.trunk.biases)
        units = len(self.channel.biases)
        self.check_layers(
            trunk=(greys + pairs, width),
            shared=(greys + width, HIDDEN_COUNT),
            channel=(width + pairs, units),
            output=(greys + pairs + units, COLUMN),
        )

    def __len__(self) -> int:
        """Number of values in a code."""
        return len(self.basis)

    @property
    def pairs(self) -> int:
        """Number of pairs in a code."""
        return (len(self.basis) - self.basis.greys) // 2

    @property
    def nbytes(self) -> int:
        """See :class:`nacre.latent.weights.WeightBasis`."""
        return self.basis.nbytes + super().nbytes

    def weights(self, codes: npt.ArrayLike) -> Matrix:
        """See :class:`nacre.latent.weights.WeightBasis`."""
        values = np.asarray(codes, np.float64)
        grey, pairs = np.split(values, [self.basis.greys], axis=1)
        pairs = pairs.reshape(len(values), self.pairs, 2)
        lengths = 0.5 * np.square(pairs).sum(axis=2) - 1.0
        common = bent(dense(np.concatenate([grey, lengths], axis=1), self.trunk))
        hidden = dense(np.concatenate([grey, common], axis=1), self.shared)
        chroma = (pairs @ CHROMA).transpose(0, 2, 1)
        grey, common = (np.repeat(a[:, None], OUTPUTS, axis=1) for a in (grey, common))
        own = bent(dense(np.concatenate([common, chroma], axis=2), self.channel))
        columns = dense(np.concatenate([grey, chroma, own], axis=2), self.output)
        last = columns.transpose(0, 2, 1).reshape(len(values), -1)
        return np.concatenate([hidden, last], axis=1)
