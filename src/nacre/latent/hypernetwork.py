"""A network that turns codes of a neural basis into ordinary networks of 675 weights.

A code of a :class:`nacre.latent.neural_basis.NeuralBasis` weighs functions, and the whole basis is
needed to evaluate it. For any code, the hypernetwork gives a network of a thirtieth of that size
which comes close.

Colors are handled by channel as they are there. The hidden layers depend on the luma and on the
squared lengths of the pairs, which permutations of the channels do not change. The weights of an
output depend on these and on the part of the pairs in its own channel, in the same way for all
three. So a permutation of the channels of a material is one of its code here too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.io.tensors import Tensors
from nacre.latent.basis import LatentBasis
from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.picture_errors import PictureErrors
from nacre.latent.posterior import Posterior
from nacre.latent.prior import Prior
from nacre.latent.recipes import HypernetworkRecipe
from nacre.latent.weights import COUNT, SIZES, WeightBasis, named_layers, named_tensors
from nacre.neural.nbrdf import OUTPUTS
from nacre.numerics.channels import CHROMA
from nacre.numerics.direction_samples import DirectionSamples
from nacre.numerics.mlp import SILU_BY_TANH, Layer, dense

COLUMN = SIZES[-2] + 1  # weights and bias of one output
HIDDEN_COUNT = COUNT - OUTPUTS * COLUMN  # weights and biases of the hidden layers


@dataclass(frozen=True, eq=False, repr=False)
class Hypernetwork(WeightBasis):
    """Four layers from a code to the weights of a network, about the basis that has the code.

    With s(x) = x / (1 + e^-x), luma g, chroma pairs p and their part c in a channel:

    - u = s(trunk of (g, |p|^2 / 2 - 1)),
    - weights of the hidden layers: shared of (g, u),
    - weights and bias of the channel's output: output of (g, c, s(channel of (u, c))).

    Raises ValueError if layers do not fit one another.
    """

    kind: ClassVar[str] = "hypernetwork"
    Recipe: ClassVar[type] = HypernetworkRecipe
    trainer: ClassVar[str] = "nacre.latent.hypernetwork_training:train_hypernetwork"
    builds_on: ClassVar[str | None] = "neural"
    takes_samples: ClassVar[bool] = True
    LAYERS: ClassVar[tuple[str, ...]] = "trunk", "shared", "channel", "output"

    basis: NeuralBasis
    trunk: Layer
    shared: Layer
    channel: Layer
    output: Layer
    metadata: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        luma, pairs, width = self.basis.luma, self.basis.chroma, len(self.trunk.biases)
        units = len(self.channel.biases)
        self.check_layers(
            trunk=(luma + pairs, width),
            shared=(luma + width, HIDDEN_COUNT),
            channel=(width + pairs, units),
            output=(luma + pairs + units, COLUMN),
        )

    @property
    def code_dim(self) -> int:
        return self.basis.code_dim

    @property
    def nbytes(self) -> int:
        return self.basis.nbytes + super().nbytes

    @property
    def prior(self) -> Prior:
        return self.basis.prior

    def weights(self, codes: npt.ArrayLike) -> Doubles:
        values = np.asarray(codes, np.float64)
        luma, pairs = np.split(values, [self.basis.luma], axis=1)
        pairs = pairs.reshape(len(values), self.basis.chroma, 2)
        lengths = 0.5 * np.square(pairs).sum(axis=2) - 1.0
        common = dense(np.concatenate([luma, lengths], axis=1), self.trunk, SILU_BY_TANH)
        hidden = dense(np.concatenate([luma, common], axis=1), self.shared)
        chroma = (pairs @ CHROMA).transpose(0, 2, 1)
        luma, common = (np.repeat(a[:, None], OUTPUTS, axis=1) for a in (luma, common))
        own = dense(np.concatenate([common, chroma], axis=2), self.channel, SILU_BY_TANH)
        columns = dense(np.concatenate([luma, chroma, own], axis=2), self.output)
        last = columns.transpose(0, 2, 1).reshape(len(values), -1)
        return np.concatenate([hidden, last], axis=1)

    def _start(self, brdf: Brdf, errors: PictureErrors) -> Doubles:
        return self.basis.closest(errors)

    def _posterior(self, samples: DirectionSamples, free_scale: bool) -> Posterior:
        return self.basis.posterior(samples, free_scale=free_scale)

    def pack(self) -> tuple[dict[str, Any], Tensors]:
        header, tensors = self.basis.pack()
        return header, tensors | named_tensors(self.layers)

    @classmethod
    def unpack(cls, header: Mapping[str, Any], tensors: Tensors) -> Hypernetwork:
        basis = NeuralBasis.unpack(header, tensors)
        return cls(basis, **named_layers(tensors, cls.LAYERS), metadata=header["metadata"])


def neural_basis(basis: LatentBasis) -> NeuralBasis:
    """The neural basis that a basis is, or was made from.

    Raises NacreError for a basis of another kind, where few samples do not determine a code.
    """
    found = basis.basis if isinstance(basis, Hypernetwork) else basis
    if not isinstance(found, NeuralBasis):
        raise NacreError(f"few observations need a neural basis; this one is {basis.kind!r}")
    return found
