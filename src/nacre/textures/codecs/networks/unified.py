"""The network of "Unified Neural Encoding of BTFs" (Rainer, Ghosh, Jakob and Weyrich 2020)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from nacre.numerics.mlp import forward
from nacre.textures.codecs.networks.mlp import (
    HIDDEN,
    INPUTS,
    Shapes,
    Tensor,
    check_sizes,
    mlp_layers,
    mlp_shapes,
    torch,
)
from nacre.textures.codecs.networks.trainable import TrainableNetwork

POOLINGS = "mean", "max"
_SLOPE = 0.25  # of the parametric ReLU below 0, before training
_PRODUCTS = 1 << 20  # products of values and weights that max pooling holds at a time
_RUN = 32  # entries of which the largest is found at once


@dataclass(frozen=True)
class UnifiedSettings:
    """Sizes of the network; the defaults are the paper's (section 4).

    For the decoder see :data:`nacre.textures.codecs.networks.mlp.DECODERS`.
    """

    latent: int = 32  # L, the values of a code
    angular: tuple[int, ...] = (128, 128, 128, 128)
    """Widths of the hidden layers of the angular MLP."""
    features: int = 800  # m, the weights that it gives for each channel
    hidden: tuple[int, ...] = (128,)  # widths of the encoder's hidden layers
    pooling: str = "mean"  # "mean" or "max": how entries of a texel become one vector
    decoder: str = "network"
    decoder_hidden: tuple[int, ...] = HIDDEN

    def __post_init__(self) -> None:
        check_sizes(self)
        if self.pooling not in POOLINGS:
            raise ValueError(f"pooling must be one of {', '.join(POOLINGS)}, got {self.pooling!r}")


class UnifiedNetwork(TrainableNetwork):
    """One encoder for texels with any number and layout of directions.

    An MLP on the stereographic coordinates of both directions gives m weights for each channel.
    They multiply the channel's value; means of the products over all n entries make a vector of 3 m
    values, whatever n is. A parametric ReLU with biases and fully connected layers follow.

    The last layer of the MLP is linear, and so is the mean: with H the outputs of its last hidden
    layer, x the values of a channel, V and c the channel's part of the last layer, (1/n) x (H V +
    c) = ((1/n) x H) V + mean(x) c. So weights of single entries are never made: a texel takes 3 n
    128 multiply-adds in place of 3 n 800. Biases stand before the parametric ReLU; behind it they
    would add to those of the next layer.

    For the parameters see :class:`nacre.textures.codecs.networks.TexelNetwork`.
    """

    kind = "unified"
    settings_type = UnifiedSettings
    starts: ClassVar[Mapping[str, float]] = {"pooled.bias": 0.0, "pooled.slope": _SLOPE}
    settings: UnifiedSettings

    def shapes(self) -> Shapes:
        sizes = self.settings
        pooled = 3 * sizes.features
        return (
            mlp_shapes("angular", (INPUTS, *sizes.angular, pooled))
            | {"pooled.bias": (pooled,), "pooled.slope": (1,)}
            | mlp_shapes("encoder", (pooled, *sizes.hidden, sizes.latent))
        )

    def prepare_encoder(self, directions: Tensor) -> Tensor:
        """Outputs of the angular MLP's last hidden layer, (n, 128), or of its last for max."""
        layers = mlp_layers(self.parameters, "angular")
        if self.settings.pooling == "max":
            return forward(directions, layers)
        return forward(directions, layers[:-1]).relu_()

    def encode(self, values: Tensor, prepared: Tensor) -> Tensor:
        pooled = (self._mean if self.settings.pooling == "mean" else self._max)(values, prepared)
        pooled = pooled.flatten(1) + self.parameters["pooled.bias"]
        slope = self.parameters["pooled.slope"].to(pooled.dtype)
        activated = torch.nn.functional.prelu(pooled, slope)
        return forward(activated, mlp_layers(self.parameters, "encoder"))

    def _mean(self, values: Tensor, hidden: Tensor) -> Tensor:
        """Means over entries of weights times values, shape (b, 3, m)."""
        weight, bias = mlp_layers(self.parameters, "angular")[-1]
        batch, _, count = values.shape
        sums = (values.reshape(3 * batch, count) @ hidden).reshape(batch, 3, -1) / count
        weights = weight.reshape(len(weight), 3, -1).transpose(0, 1)
        linear = torch.bmm(sums.transpose(0, 1), weights).transpose(0, 1)
        return linear + values.mean(2, keepdim=True) * bias.reshape(3, -1)

    def _max(self, values: Tensor, weights: Tensor) -> Tensor:
        """Largest of weights times values over the entries, shape (b, 3, m).

        The places of the largest products are found for few texels and entries at a time, so that
        not all are in memory; gradients flow through those alone.
        """
        weights = weights.reshape(values.shape[2], 3, -1).transpose(0, 1)
        texels = max(1, _PRODUCTS // (_RUN * weights[:, 0].numel()))
        with torch.no_grad():
            index = torch.cat([_largest(part, weights) for part in values.split(texels)])
        channel = torch.arange(3, device=values.device)[:, None]
        feature = torch.arange(self.settings.features, device=values.device)
        return values.gather(2, index) * weights[channel, index, feature]


def _largest(values: Tensor, weights: Tensor) -> Tensor:
    """At which entry values (b, 3, n) times weights (3, n, m) are largest, shape (b, 3, m).

    The largest of each run of entries comes without its place, which is several times faster; the
    place is looked for in the best run alone.
    """
    count, each = weights.shape[1], min(_RUN, max(1, _PRODUCTS // weights[:, 0].numel()))
    starts = iter(range(0, count, each))

    def of_run(start: int) -> Tensor:
        run = slice(start, start + each)
        return (values[:, :, run, None] * weights[:, run]).amax(2)

    largest = of_run(next(starts))
    best = torch.zeros(largest.shape, dtype=torch.long, device=values.device)
    for start in starts:
        found = of_run(start)
        best.masked_fill_(found > largest, start)
        largest = torch.maximum(largest, found)
    entries = (best[..., None] + torch.arange(each, device=values.device)).clamp_(max=count - 1)
    channel = torch.arange(3, device=values.device)[:, None, None]
    feature = torch.arange(weights.shape[2], device=values.device)[:, None]
    seen = values.gather(2, entries.flatten(2)).reshape(entries.shape)
    within = (seen * weights[channel, entries, feature]).argmax(3, keepdim=True)
    return entries.gather(3, within)[..., 0]
