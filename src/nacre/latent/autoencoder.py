"""The autoencoder of the NBRDF paper: weights of a network to a code, and back.

NBRDF paper, section 3.2 and Figure 3.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.latent.directions import isotropic_values
from nacre.latent.distillation import Distillation
from nacre.latent.weights import COUNT, Matrix, WeightBasis, bent, dense
from nacre.numerics.mlp import Layer


@dataclass(frozen=True, eq=False)
class Autoencoder(WeightBasis):
    """Two layers from the 675 weights of a network to a code, and two back.

    x / (1 + e^-x) follows the first and the third. Over the networks it was trained on, each with
    its permutations of the channels, every value of a code has mean 0 and variance 1.

    Parameters
    ----------
    common
        Weights of the network that all others are fitted from, shape (675,), float32.
    contract, code, expand, network
        The layers.
    seed
        Of the fits; see :class:`nacre.latent.distillation.Distillation`.
    metadata
        JSON-able facts about the training.

    Raises
    ------
    ValueError
        If layers do not fit to one another.
    """

    LAYERS = "contract", "code", "expand", "network"

    common: npt.NDArray[np.float32]
    contract: Layer
    code: Layer
    expand: Layer
    network: Layer
    seed: int
    metadata: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        width, values = len(self.contract.biases), len(self)
        if self.common.shape != (COUNT,) or self.seed < 0:
            raise ValueError(f"common {self.common.shape} is no network, or seed is negative")
        units = len(self.expand.biases)
        self.check_layers(
            contract=(COUNT, width),
            code=(width, values),
            expand=(values, units),
            network=(units, COUNT),
        )

    def __len__(self) -> int:
        """Number of values in a code."""
        return len(self.code.biases)

    @property
    def nbytes(self) -> int:
        """See :class:`nacre.latent.weights.WeightBasis`."""
        return self.common.nbytes + super().nbytes

    def weights(self, codes: npt.ArrayLike) -> Matrix:
        """See :class:`nacre.latent.weights.WeightBasis`."""
        return dense(bent(dense(np.asarray(codes, np.float64), self.expand)), self.network)

    def codes(self, weights: npt.ArrayLike) -> Matrix:
        """Codes of networks fitted from the common one, shape (n, k), for (n, 675)."""
        return dense(bent(dense(np.asarray(weights, np.float64), self.contract)), self.code)

    def project(self, brdf: Brdf) -> npt.NDArray[np.float64]:
        """The code that the encoder gives a reflectance, shape (k,).

        A network is fitted to it from the common one, which takes a fraction of a second.

        Raises
        ------
        FormatError
            If `brdf` is anisotropic.
        NacreError
            If it is known at none of the directions.
        """
        distillation = Distillation(self.seed)
        f_r = isotropic_values(brdf, distillation.wi, distillation.wo)
        code: npt.NDArray[np.float64] = self.codes(distillation.weights(self.common, f_r)[None])[0]
        return code
