"""Networks as PyTorch modules: directions and weights with gradients, on any device."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from nacre.array import namespace
from nacre.errors import require
from nacre.geometry import broadcast_shape
from nacre.neural.nbrdf import NeuralBrdf, check_weights, round_layers
from nacre.neural.torch_layers import evaluated
from nacre.numerics.mlp import Layer

torch: Any = require("torch", "torch")
Tensor: TypeAlias = Any


class NetworkModule(torch.nn.Module):  # type: ignore[misc]
    """A network, or a stack of networks of one shape, whose weights are parameters.

    `weights` and `biases` hold a tensor per layer: shapes (inputs, outputs) and (outputs,), in a
    stack (materials, inputs, outputs) and (materials, outputs). :func:`module` makes one.

    Gradients are finite for any pair of unit directions, but only as small as those of the inputs:
    they grow without bound where the half vector comes near the normal, about which its azimuth
    turns.
    """

    def __init__(self, networks: Sequence[NeuralBrdf], stacked: bool) -> None:
        super().__init__()
        self.networks, self.stacked = tuple(networks), stacked
        self.isotropic, self.inputs = networks[0].isotropic, networks[0].inputs
        self.activation = networks[0].activation

        def parameters(index: int) -> Any:
            layers = zip(*(network.layers for network in networks), strict=True)
            arrays = (np.stack([tuple(layer)[index] for layer in same]) for same in layers)
            tensors = (torch.from_numpy(array if stacked else array[0]) for array in arrays)
            return torch.nn.ParameterList([torch.nn.Parameter(tensor) for tensor in tensors])

        self.weights, self.biases = parameters(0), parameters(1)

    def extra_repr(self) -> str:
        count = f"{len(self.networks)} x " if self.stacked else ""
        return count + self.networks[0].summary()

    def brdf(self, index: int = 0) -> NeuralBrdf:
        """The network as it is now, or that of a material of a stack, which can be saved.

        Weights are rounded to the precision in which the network was stored. Facts about its fit
        are left out where weights have changed; the sampler stays: :func:`nacre.sampling.fit_lobes`
        fits lobes to the new reflectance.

        Raises IndexError if there is no such material, ValueError if weights are not finite, or so
        large that sums of them overflow.
        """
        network = self.networks[index]
        pairs = [
            (p[index] if self.stacked else p for p in pair)
            for pair in zip(self.weights, self.biases, strict=True)
        ]
        found = [Layer(*(p.detach().cpu().float().numpy() for p in pair)) for pair in pairs]
        check_weights(found, network.activation)
        layers = round_layers(found, network.precision)
        same = zip(layers, network.layers, strict=True)
        if all(np.array_equal(a, b) for pair in same for a, b in zip(*pair, strict=True)):
            return network
        kept = {k: v for k, v in network.metadata.items() if k not in ("fit", "quality")}
        return network.with_layers(layers).replaced(metadata=kept)

    def forward(self, wi: Tensor, wo: Tensor) -> Tensor:
        """f_r in 1/sr, linear RGB, without the cosine, as :meth:`nacre.Brdf.eval` returns it.

        `wi` and `wo` are directions to the light and to the viewer, taken to be of unit length, in
        shapes (..., 3) that broadcast; in a stack, to (materials, n, 3). f_r has that shape and is
        non-negative; 0 where either direction is at or below the horizon; float64 if an input is,
        else float32. Raises ValueError if shapes are not as above.
        """
        wi, wo = namespace(wi, wo).matched(wi, wo)
        shape = self._shape(wi, wo)
        wi, wo = (w.expand(shape) for w in (wi, wo))
        if not self.stacked:
            wi, wo = (w.reshape(1, math.prod(shape[:-1]), 3) for w in (wi, wo))
        stacks = (
            [p if self.stacked else p[None] for p in ps] for ps in (self.weights, self.biases)
        )
        layers = list(zip(*stacks, strict=True))
        values = evaluated(self.networks[0], layers, wi, wo, self._angle(wi))
        return values if self.stacked else values.reshape(shape)

    def _shape(self, wi: Tensor, wo: Tensor) -> tuple[int, ...]:
        """What both tensors are expanded to: (..., 3), or in a stack (materials or 1, n, 3)."""
        shape = broadcast_shape(wi=wi, wo=wo)
        if not self.stacked:
            return shape
        whole = (1,) * (3 - len(shape)) + shape
        count = len(self.networks)
        if len(whole) > 3 or whole[0] not in (1, count):
            raise ValueError(f"expected shapes that broadcast to ({count}, n, 3), got {shape}")
        return whole

    def _angle(self, like: Tensor) -> Tensor | float:
        """Azimuth of the axes: one for all materials, or of shape (materials, 1)."""
        angles = [network.angle for network in self.networks]
        if len(set(angles)) == 1:
            return angles[0]
        return torch.tensor(angles, dtype=like.dtype, device=like.device)[:, None]


def module(brdf: NeuralBrdf | Sequence[NeuralBrdf]) -> NetworkModule:
    """A network as a PyTorch module, or networks of one shape as one module.

    Networks in a sequence must have the same inputs, isotropy, activation and sizes of layers. They
    stay as they are: parameters are copies, on the CPU in single precision. The module takes
    directions `(wi, wo)`, and :meth:`NetworkModule.brdf` gives networks back.

    Raises
    ------
    TypeError
        If something is not a network.
    ValueError
        If there is no network, or their shapes differ.

    Examples
    --------
    >>> import torch
    >>> from nacre.neural import Layer, NeuralBrdf
    >>> network = NeuralBrdf([Layer(torch.zeros(6, 3), torch.ones(3))])
    >>> up = torch.tensor([0.0, 0.0, 1.0])
    >>> module(network)(up, up).shape
    torch.Size([3])
    >>> module([network, network])(up, up.expand(5, 3)).shape
    torch.Size([2, 5, 3])
    """
    networks = [brdf] if isinstance(brdf, NeuralBrdf) else list(brdf)
    if not networks:
        raise ValueError("a stack has at least one network")
    for network in networks:
        if not isinstance(network, NeuralBrdf):
            kind = type(network).__name__
            raise TypeError(f"expected a network, got {kind}; nacre.fit makes networks")
    shapes = [(x.inputs, x.isotropic, x.activation, x.sizes) for x in networks]
    different = next((i for i, shape in enumerate(shapes) if shape != shapes[0]), None)
    if different is not None:
        one, other = (networks[i].summary() for i in (0, different))
        raise ValueError(f"networks of a stack have one shape: 0 is {one}; {different} is {other}")
    return NetworkModule(networks, stacked=not isinstance(brdf, NeuralBrdf))
