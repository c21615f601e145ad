"""The fit in plain PyTorch: the maths of the CPU kernel, on any device."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.files import NacreError, require
from nacre.neural.nbrdf import Layer
from nacre.neural.samples import BLOCK, Samples

torch: Any = require("torch", "latent")
Tensor: TypeAlias = Any


class TorchTrainer:
    """Weights and optimiser state of one network on a PyTorch device.

    Parameters
    ----------
    layers
        Initial layers; copied.
    batch
        Samples a step, a multiple of 16.
    device
        PyTorch device: "cpu", "cuda", "cuda:1".

    Raises
    ------
    NacreError
        If PyTorch has no such device here.
    """

    def __init__(self, layers: Sequence[Layer], batch: int, device: str) -> None:
        if batch < BLOCK or batch % BLOCK:
            raise ValueError(f"batch must be a positive multiple of {BLOCK}, got {batch}")
        self._batch = batch // BLOCK
        try:
            self._device = torch.device(device)
            self._parameters = [
                torch.tensor(part, device=self._device, requires_grad=True)
                for layer in layers
                for part in (layer.weights, layer.biases)
            ]
            float((self._parameters[0] @ self._parameters[0].T).sum().detach())
        except Exception as error:  # devices fail in ways of their own
            reason = str(error).partition("\n")[0]
            raise NacreError(f"device {device!r} cannot be used: {reason}") from error
        self._means = [torch.zeros_like(p) for p in self._parameters]
        self._squares = [torch.zeros_like(p) for p in self._parameters]
        self._step = 0
        self._uploaded: dict[int, tuple[Samples, Tensor]] = {}

    def layers(self) -> list[Layer]:
        """Copies of the current layers."""
        arrays = [p.detach().cpu().numpy().copy() for p in self._parameters]
        return [Layer(w, b) for w, b in zip(arrays[::2], arrays[1::2], strict=True)]

    def gradient(self, samples: Samples, order: npt.NDArray[np.int64]) -> tuple[float, list[Layer]]:
        """Mean loss over the blocks in `order` and its gradient, as layers."""
        loss, gradients = self._gradient(self._blocks(samples)[self._index(order)])
        arrays = [g.cpu().numpy() for g in gradients]
        return float(loss), [Layer(w, b) for w, b in zip(arrays[::2], arrays[1::2], strict=True)]

    def epoch(
        self, samples: Samples, order: npt.NDArray[np.int64], rates: npt.NDArray[np.float32]
    ) -> None:
        """One step per learning rate over the blocks in `order`."""
        blocks, index = self._blocks(samples), self._index(order)
        for rate, part in zip(rates.tolist(), index.split(self._batch), strict=True):
            self._adam(self._gradient(blocks[part])[1], rate)

    def loss(self, samples: Samples) -> float:
        """Mean loss over all samples."""
        blocks = self._blocks(samples)
        with torch.no_grad():
            parts = blocks.split(4096)
            return sum(float(self._mean_loss(p)) * len(p) for p in parts) / len(blocks)

    def _index(self, order: npt.NDArray[np.int64]) -> Tensor:
        return torch.from_numpy(order).to(self._device)

    def _blocks(self, samples: Samples) -> Tensor:
        """Samples on the device, uploaded once: shape (blocks, rows, 16)."""
        if id(samples) not in self._uploaded:
            shaped = samples.blocks.reshape(-1, samples.rows, BLOCK)
            self._uploaded[id(samples)] = samples, torch.from_numpy(shaped).to(self._device)
        return self._uploaded[id(samples)][1]

    def _mean_loss(self, blocks: Tensor) -> Tensor:
        rows = blocks.transpose(1, 2).reshape(-1, blocks.shape[1])
        x, target, weight = rows[:, :-4], rows[:, -4:-1], rows[:, -1:]
        for index in range(0, len(self._parameters), 2):
            x = torch.relu(x) if index else x
            x = torch.addmm(self._parameters[index + 1], x, self._parameters[index])
        weighted = (torch.exp(x) - 1.0) * weight
        # As in the kernel: with a weight above 1, 1 + weighted can be negative.
        sign = torch.where((weight > 1.0) & (weighted < 0.0), -1.0, 1.0)
        logarithm = sign * torch.log(1.0 + sign * weighted)
        return (logarithm - torch.log1p(target)).abs().mean()

    def _gradient(self, blocks: Tensor) -> tuple[Tensor, Sequence[Tensor]]:
        loss = self._mean_loss(blocks)
        return loss.detach(), torch.autograd.grad(loss, self._parameters)

    def _adam(self, gradients: Sequence[Tensor], rate: float) -> None:
        self._step += 1
        rate /= 1.0 - 0.9**self._step
        unbias = 1.0 / math.sqrt(1.0 - 0.999**self._step)
        with torch.no_grad():
            torch._foreach_lerp_(self._means, gradients, 0.1)
            torch._foreach_mul_(self._squares, 0.999)
            torch._foreach_addcmul_(self._squares, gradients, gradients, 0.001)
            scale = torch._foreach_sqrt(self._squares)
            torch._foreach_mul_(scale, unbias)
            torch._foreach_add_(scale, 1e-8)
            torch._foreach_addcdiv_(self._parameters, self._means, scale, -rate)
