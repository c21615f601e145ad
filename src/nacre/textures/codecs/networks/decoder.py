"""From a code and a pair of directions to reflectance: what all networks share."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nacre.textures.codecs.networks.mlp import (
    Parameters,
    Shapes,
    Tensor,
    mlp_layers,
    mlp_shapes,
    run_mlp,
    torch,
)

INPUTS = 4
"""Stereographic coordinates of the light and of the viewer."""
HIDDEN = (106, 106, 106, 106)
"""Widths of the hidden layers (Rainer et al. 2020, section 4; as in Rainer et al. 2019)."""
DECODERS = "network", "bilinear"
_COEFFICIENTS = 128
"""Width of the layer between a code and the coefficients of the bilinear decoder."""


@dataclass(frozen=True)
class Decoder:
    """The sizes of a decoder, and what it does with its tensors.

    The "network" is the paper's: hidden layers with ReLUs on the code and the stereographic
    coordinates of both directions. The "bilinear" one is ours: a network of the directions alone
    gives as many features as its last width, a network of the code as many coefficients for each
    channel, and a value is their product, so that a code that is met often costs one dot product
    for each channel and pair of directions.

    Parameters
    ----------
    latent
        L, the values of a code.
    hidden
        Widths.
    kind
        One of :data:`DECODERS`.
    """

    latent: int
    hidden: tuple[int, ...] = HIDDEN
    kind: str = "network"

    def shapes(self) -> Shapes:
        """Names and shapes of the tensors."""
        if self.kind == "network":
            return mlp_shapes("decoder", (self.latent + INPUTS, *self.hidden, 3))
        features = self.hidden[-1]
        return mlp_shapes("features", (INPUTS, *self.hidden)) | mlp_shapes(
            "coefficients", (self.latent, _COEFFICIENTS, 3 * features)
        )

    def prepare(self, parameters: Parameters, directions: Tensor) -> Tensor:
        """What depends on the pairs of directions only, shape (n, width).

        Parameters
        ----------
        parameters
            Tensors of :meth:`shapes`, and maybe others.
        directions
            Stereographic coordinates of light and viewer, shape (n, 4).
        """
        if self.kind == "bilinear":
            features = run_mlp(directions, mlp_layers(parameters, "features"))
            return features / math.sqrt(self.hidden[-1])
        weight, bias = mlp_layers(parameters, "decoder")[0]
        return torch.addmm(bias, directions, weight[self.latent :])

    def decode(self, parameters: Parameters, codes: Tensor, prepared: Tensor) -> Tensor:
        """Whitened logarithms, shape (b, n, 3), of codes of shape (b, L).

        The part of the first layer that sees the code is evaluated once a code, that which sees
        the directions has been once a pair of directions.
        """
        if self.kind == "bilinear":
            coefficients = run_mlp(codes, mlp_layers(parameters, "coefficients"))
            products = coefficients.reshape(-1, prepared.shape[1]) @ prepared.mT
            return products.reshape(len(codes), 3, -1).mT
        (weight, _), *others = mlp_layers(parameters, "decoder")
        first = (codes @ weight[: self.latent])[:, None] + prepared
        values = run_mlp(first.relu_().flatten(0, 1), others)
        return values.reshape(len(codes), len(prepared), 3)
