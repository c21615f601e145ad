"""The layers of networks in PyTorch: one forward pass, with gradients, on any device."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import chain
from typing import Any, TypeAlias

from nacre.brdf import above_horizon
from nacre.errors import require
from nacre.geometry import join
from nacre.neural.inputs import network_inputs
from nacre.neural.network import NetworkBrdf
from nacre.numerics.mlp import activate

torch: Any = require("torch", "torch")
Tensor: TypeAlias = Any
Layers: TypeAlias = Sequence[tuple[Tensor, Tensor]]
"""Weights (materials, inputs, outputs) and biases (materials, outputs) of each layer."""

_LARGEST = 88.0  # bound of outputs: e^x of more is infinite, and its gradient no number
_CHUNK = 1 << 14  # values of a layer's unit evaluated at a time: layers stay in the cache
_KEPT = 32  # networks whose weights stay on a device between calls


def evaluated(
    network: NetworkBrdf, layers: Layers, wi: Tensor, wo: Tensor, angle: Tensor | float
) -> Tensor:
    """f_r in 1/sr, shape (materials, n, 3), of layers in place of those of a network.

    `wi` and `wo` are unit directions, (materials or 1, n, 3); `angle` is the azimuth of the axes,
    one for all or of shape (materials, 1).
    """
    layers = [(weights.to(wi.dtype), biases.to(wi.dtype)) for weights, biases in layers]
    graph = torch.is_grad_enabled() and any(x.requires_grad for x in (wi, wo, *chain(*layers)))
    chunk = max(1, _CHUNK // len(layers[0][0]))
    if graph or wi.device.type != "cpu" or torch.compiler.is_compiling():
        chunk = max(1, wi.shape[1])
    pairs = zip(wi.split(chunk, 1), wo.split(chunk, 1), strict=True)
    return torch.cat([_part(network, layers, *pair, angle) for pair in pairs], 1)


def _part(
    network: NetworkBrdf, layers: Layers, wi: Tensor, wo: Tensor, angle: Tensor | float
) -> Tensor:
    light, view = (w.movedim(-1, 0).contiguous().unbind() for w in (wi, wo))
    inputs = network_inputs(light, view, network.isotropic, network.inputs, angle)
    rows = [x if isinstance(x, torch.Tensor) else torch.full_like(light[0], x) for x in inputs]
    # One row per unit: with one per pair, products of such small layers take half as long again.
    values = torch.stack(torch.broadcast_tensors(*rows), 1).expand(len(layers[0][0]), -1, -1)
    *hidden, (weights, biases) = layers
    for w, b in hidden:
        values = activate(torch.baddbmm(b[..., None], w.mT, values), network.activation)
    values = torch.baddbmm(biases[..., None], weights.mT, values).clamp(max=_LARGEST)
    return join(above_horizon(network.from_outputs(values.unbind(1)), light, view))


@lru_cache(maxsize=_KEPT)
def constant_layers(network: NetworkBrdf, device: Any) -> Layers:
    """The layers of one network on a device, without gradients."""
    return [
        tuple(torch.from_numpy(array)[None].to(device) for array in layer)
        for layer in network.layers
    ]
