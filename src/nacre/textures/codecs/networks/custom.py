"""The network of "Neural BTF Compression and Interpolation" (Rainer et al. 2019).

The paper of 2020 says what its encoder is: convolutions in one dimension over the ordered list of
reflectance, downsampling by max pooling, then fully connected layers with ReLUs; the decoder is the
one that it adopts itself, and eight values serve a material. The paper does not give numbers and
sizes of the encoder's layers; those here are ours: four convolutions of nine entries with 16, 16,
32 and 32 channels, each followed by a ReLU and the largest of four, and one hidden layer of 128.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.measured.textures.directions import same_pairs
from nacre.numerics.mlp import forward
from nacre.textures.codecs.networks.mlp import (
    HIDDEN,
    Shapes,
    Tensor,
    check_sizes,
    mlp_layers,
    mlp_shapes,
    torch,
)
from nacre.textures.codecs.networks.preprocessing import Whitening
from nacre.textures.codecs.networks.trainable import TrainableNetwork


@dataclass(frozen=True)
class CustomSettings:
    """Sizes of the network; for the decoder see
    :data:`nacre.textures.codecs.networks.mlp.DECODERS`.
    """

    latent: int = 8  # L, the values of a code
    channels: tuple[int, ...] = (16, 16, 32, 32)  # of the convolutions, in order
    kernel: int = 9  # entries that a convolution sees, an odd number
    pool: int = 4  # entries of which the largest goes on
    hidden: tuple[int, ...] = (128,)  # widths of the fully connected hidden layers
    decoder: str = "network"
    decoder_hidden: tuple[int, ...] = HIDDEN

    def __post_init__(self) -> None:
        check_sizes(self)
        if self.kernel % 2 == 0 or self.kernel > 255 or not 2 <= self.pool <= 256:
            raise ValueError(
                f"kernel must be odd and pool 2 or more, got {self.kernel}, {self.pool}"
            )


class CustomNetwork(TrainableNetwork):
    """An encoder for one set of pairs of directions `wi` and `wo`, shape (n, 3), in their order.

    Trained on one material, it is overfitted to it, as its authors use it; trained on many, it is
    the "custom network trained on all" of Rainer et al. 2020, Figure 4. For other parameters and
    errors see :class:`nacre.textures.codecs.networks.TexelNetwork`.
    """

    kind = "custom"
    settings_type = CustomSettings
    training_defaults: ClassVar[Mapping[str, Any]] = {"loss": "l2", "permute": False}
    recipe_defaults: ClassVar[Mapping[str, Any]] = {"batch": 32, "loss_directions": 512}
    settings: CustomSettings
    fixed_directions = True

    def __init__(
        self,
        wi: Floats,
        wo: Floats,
        settings: CustomSettings,
        whitening: Whitening,
        parameters: dict[str, npt.NDArray[np.float32]] | None = None,
        seed: int = 0,
        variance: str = "he",
    ) -> None:
        if wi.shape != wo.shape or wi.ndim != 2 or wi.shape[1] != 3 or not len(wi):
            raise ValueError(f"directions have shapes {wi.shape}, {wo.shape}, expected (n, 3)")
        self.wi, self.wo = (np.ascontiguousarray(w, np.float32) for w in (wi, wo))
        super().__init__(settings, whitening, parameters, seed, variance)

    def shapes(self) -> Shapes:
        sizes, shapes, length, inputs = self.settings, Shapes(), len(self.wi), 3
        for index, outputs in enumerate(sizes.channels):
            shapes[f"convolution.{index}.weight"] = (outputs, inputs, sizes.kernel)
            shapes[f"convolution.{index}.bias"] = (outputs,)
            length, inputs = -(-length // sizes.pool), outputs
        return shapes | mlp_shapes("encoder", (inputs * length, *sizes.hidden, sizes.latent))

    def check_directions(self, wi: Floats, wo: Floats) -> None:
        if same_pairs(wi, wo, self.wi, self.wo):
            return
        own = len(self.wi)
        found = "others" if len(wi) == own else f"{len(wi):,}"
        raise NacreError(
            f"the network of 2019 encodes texels at its own {own:,} pairs of directions only, "
            f"in their order, got {found}; train one for these, or take a unified one"
        )

    def prepare_encoder(self, directions: Tensor) -> None:
        """Nothing: the order of the entries stands for the directions."""

    def encode(self, values: Tensor, prepared: None) -> Tensor:
        del prepared
        sizes, functional = self.settings, torch.nn.functional
        for weight, bias in mlp_layers(self.parameters, "convolution"):
            values = functional.conv1d(values, weight, bias, padding=sizes.kernel // 2).relu_()
            values = functional.max_pool1d(values, sizes.pool, ceil_mode=True)
        return forward(values.flatten(1), mlp_layers(self.parameters, "encoder"))
