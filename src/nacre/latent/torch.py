"""Codes in PyTorch: what they stand for and how plausible they are, with gradients."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from nacre.array import namespace
from nacre.brdf import above_horizon
from nacre.errors import NacreError, require
from nacre.geometry import join
from nacre.latent.basis import LatentBasis
from nacre.latent.neural_basis import BRIGHTEST, NeuralBasis
from nacre.latent.prior import ANYWHERE, SCALES, WEIGHTS
from nacre.neural.inputs import ENHANCED, network_inputs
from nacre.numerics.channels import CHROMA
from nacre.numerics.mlp import forward

torch: Any = require("torch", "torch")
Tensor: TypeAlias = Any


class CodeSpace(torch.nn.Module):  # type: ignore[misc]
    """The codes of a neural basis as a PyTorch module.

    The basis is fixed: its numbers are buffers, which follow the module to another device. An
    optimization changes the code. Raises NacreError if the basis is of another kind; codes of a
    hypernetwork are those of its `basis`.

    Examples
    --------
    >>> import torch, nacre
    >>> space = CodeSpace(nacre.latent.pretrained_basis())
    >>> code = torch.zeros(32, requires_grad=True)
    >>> up = torch.tensor([0.0, 0.0, 1.0])
    >>> loss = space.decode(code, up, up).sum() - space.log_prior(code)
    >>> loss.backward()
    >>> code.grad.shape
    torch.Size([32])
    """

    def __init__(self, basis: LatentBasis) -> None:
        super().__init__()
        self.basis = neural(basis)
        blobs = basis.prior.blobs
        arrays = {f"weights_{i}": layer.weights for i, layer in enumerate(self.basis.hidden)}
        arrays |= {f"biases_{i}": layer.biases for i, layer in enumerate(self.basis.hidden)}
        arrays |= {"functions": self.basis.functions, "chroma": CHROMA}
        arrays |= {f"blob_{name}": array for name, array in blobs._asdict().items()}
        for name, array in arrays.items():
            self.register_buffer(name, torch.from_numpy(np.array(array)), persistent=False)

    def decode(self, code: Tensor, wi: Tensor, wo: Tensor) -> Tensor:
        """f_r in 1/sr of codes (..., k), linear RGB, without the cosine, shape (..., 3).

        `wi` and `wo` are unit directions to the light and to the viewer, shapes (..., 3). All
        leading shapes broadcast: codes (n, 1, k) and directions (m, 3) give every pair of them. f_r
        is positive and at most a million; 0 where either direction is at or below the horizon.
        float64 if an input is, else float32.
        """
        code, wi, wo = namespace(code, wi, wo).matched(code, wi, wo)
        light, view = (w.unbind(-1) for w in torch.broadcast_tensors(wi, wo))
        rows = network_inputs(light, view, True, ENHANCED)
        layers = [
            (self._like(f"weights_{i}", code), self._like(f"biases_{i}", code))
            for i in range(len(self.basis.hidden))
        ]
        functions = self._like("functions", code)
        values = forward(join(rows), [*layers, (functions[:-1], functions[-1])])
        luma, pairs = code[..., : self.basis.luma], code[..., self.basis.luma :]
        chroma = pairs.unflatten(-1, (self.basis.chroma, 2)) @ self._like("chroma", code)
        common, grays, colors = values.split([1, self.basis.luma, self.basis.chroma], -1)
        gray = common + (grays * luma).sum(-1, keepdim=True)
        logs = gray + (colors[..., None] * chroma).sum(-2)
        rgb = logs.clamp(max=BRIGHTEST).exp().unbind(-1)
        return join(above_horizon(rgb, light, view))

    def log_prior(self, code: Tensor) -> Tensor:
        """Logarithm of the density of codes (..., k), shape (...); see
        :class:`nacre.latent.Prior`.
        """
        flat = code.reshape(-1, code.shape[-1])
        away = flat[:, None] - self._like("blob_centers", code)
        whitened = torch.einsum("nij,bnj->bni", self._like("blob_whitening", code), away)
        lengths = whitened.square().sum(-1)
        heights, k = self._like("blob_logarithms", code), code.shape[-1]
        logs = []
        for weight, scale in zip(WEIGHTS, SCALES, strict=False):
            height = float(np.log(weight / max(len(heights), 1)) - 0.5 * k * np.log(scale))
            logs.append(height + heights - 0.5 / scale * lengths)
        square = flat.square().sum(-1, keepdim=True)
        for weight, variance in zip(WEIGHTS[len(SCALES) :], ANYWHERE, strict=True):
            height = float(np.log(weight) - 0.5 * k * np.log(2.0 * np.pi * variance))
            logs.append(height - 0.5 / variance * square)
        return torch.cat(logs, -1).logsumexp(-1).reshape(code.shape[:-1])

    def _like(self, name: str, code: Tensor) -> Tensor:
        return getattr(self, name).to(code.dtype)


def neural(basis: LatentBasis) -> NeuralBasis:
    """The basis, where it is neural; NacreError where it is not."""
    if not isinstance(basis, NeuralBasis):
        raise NacreError(f"expected a neural basis, got one of the kind {basis.kind!r}")
    return basis
