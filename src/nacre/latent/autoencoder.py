"""The autoencoder of the NBRDF paper: weights of a network to a code, and back.

NBRDF paper, section 3.2 and Figure 3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Weights
from nacre.brdf import Brdf
from nacre.io.tensors import Tensors
from nacre.latent.basis import integer
from nacre.latent.directions import isotropic_values
from nacre.latent.distillation import EPOCHS, Distillation
from nacre.latent.lobe_predictor import LobePredictor
from nacre.latent.neural_basis import check_tensors
from nacre.latent.picture_errors import PictureErrors
from nacre.latent.predicting import PredictingBasis, no_examples, pack_predictors, unpack_predictors
from nacre.latent.recipes import AutoencoderRecipe
from nacre.latent.weights import COUNT, WeightBasis, named_layers, named_tensors
from nacre.numerics.mlp import SILU_BY_TANH, Layer, forward

_FIRST_EPOCHS = 40  # of fits, for files that do not say


@dataclass(frozen=True, eq=False, repr=False)
class Autoencoder(WeightBasis, PredictingBasis):
    """Two layers from the 675 weights of a network to a code, and two back.

    x / (1 + e^-x) follows the first and the third. Over the networks it was trained on, each with
    its permutations of the channels, every value of a code has mean 0 and variance 1. Lobe
    predictors are for codes that the encoder gives, as in section 3.3 of the paper.

    Raises ValueError if layers do not fit one another, or examples or a predictor are for other
    codes.
    """

    kind: ClassVar[str] = "autoencoder"
    Recipe: ClassVar[type] = AutoencoderRecipe
    trainer: ClassVar[str] = "nacre.latent.autoencoder_training:train_autoencoder"
    projects: ClassVar[bool] = True
    LAYERS: ClassVar[tuple[str, ...]] = "contract", "code", "expand", "network"

    common: Weights
    """Weights of the network that all others are fitted from, shape (675,), float32."""
    contract: Layer
    code: Layer
    expand: Layer
    network: Layer
    seed: int  # of the fits; see Distillation
    metadata: dict[str, Any] = field(default_factory=dict)
    examples: Weights | None = None
    """The encoder's codes of the training materials, with their channels in all orders, shape (m,
    6, k), float32; None where they are not kept."""
    predictors: Mapping[str, LobePredictor] = field(default_factory=dict)
    epochs: int = EPOCHS  # of a fit

    def __post_init__(self) -> None:
        width, values = len(self.contract.biases), self.code_dim
        if self.common.shape != (COUNT,) or self.seed < 0 or self.epochs < 1:
            raise ValueError(
                f"common {self.common.shape} is no network, seed is negative or epochs not positive"
            )
        units = len(self.expand.biases)
        self.check_layers(
            contract=(COUNT, width),
            code=(width, values),
            expand=(values, units),
            network=(units, COUNT),
        )
        if self.orders().shape[1:] != (6, values):
            raise ValueError(f"examples are no codes of {values} values in six orders")
        self.check_predictors()

    @property
    def code_dim(self) -> int:
        return len(self.code.biases)

    @property
    def nbytes(self) -> int:
        shared = self.common.nbytes + super().nbytes
        return shared + self.orders().nbytes + self.predictor_bytes()

    def orders(self) -> Weights:
        return no_examples(self.code_dim) if self.examples is None else self.examples

    def weights(self, codes: npt.ArrayLike) -> Doubles:
        values = np.asarray(codes, np.float64)
        return np.asarray(forward(values, [self.expand, self.network], SILU_BY_TANH))

    def codes(self, weights: npt.ArrayLike) -> Doubles:
        """Codes of networks fitted from the common one, shape (n, k), for (n, 675)."""
        values = np.asarray(weights, np.float64)
        return np.asarray(forward(values, [self.contract, self.code], SILU_BY_TANH))

    def _projected(self, brdf: Brdf) -> Doubles:
        """The code that the encoder gives a reflectance, after a network is fitted to it from the
        common one: a fraction of a second.
        """
        distillation = Distillation(self.seed, self.epochs)
        f_r = isotropic_values(brdf, distillation.wi, distillation.wo)
        return np.asarray(self.codes(distillation.weights(self.common, f_r)[None])[0])

    def _start(self, brdf: Brdf, errors: PictureErrors) -> Doubles:
        return self._projected(brdf)

    def pack(self) -> tuple[dict[str, Any], Tensors]:
        tensors: Tensors = {"common": np.ascontiguousarray(self.common)}
        if self.examples is not None:
            tensors["examples"] = np.ascontiguousarray(self.examples)
        fields, predictors = pack_predictors(self.predictors)
        settings = {"seed": self.seed, "epochs": self.epochs} | fields
        if self.epochs == _FIRST_EPOCHS:
            del settings["epochs"]  # files that do not say keep their checksum
        return settings, tensors | named_tensors(self.layers) | predictors

    @classmethod
    def unpack(cls, header: Mapping[str, Any], tensors: Tensors) -> Autoencoder:
        check_tensors(tensors)
        layers = named_layers(tensors, cls.LAYERS)
        return cls(
            tensors["common"],
            **layers,
            seed=integer(header, "seed"),
            metadata=header["metadata"],
            examples=tensors.get("examples"),
            predictors=unpack_predictors(header, tensors),
            epochs=integer(header, "epochs") if "epochs" in header else _FIRST_EPOCHS,
        )
