"""The fit in PyTorch, on any device: the maths of the CPU kernel for many materials at once.

Networks of one shape make a *stack*: their weights lie in one tensor per layer, and a step of all
is a handful of batched matrix products. Small as they are, that is what keeps a GPU busy; the rest
of the time there goes into launching kernels, so a step is recorded once as a CUDA graph and then
replayed.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.errors import require
from nacre.neural.samples import BLOCK, MIN_SLOPE, Samples
from nacre.neural.torch_module import NetworkModule, module
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer, dense
from nacre.runtime.device import open_device

__all__ = ["NetworkModule", "SampleStack", "TorchTrainer", "module", "stack_bytes"]

torch: Any = require("torch", "torch")
adam: Any = require("torch.optim.adam", "torch").adam
Tensor: TypeAlias = Any

_LARGEST = 88.0  # bound of outputs, as in the kernel: e^x of more is infinite in single precision
_LOSS_BLOCKS = 4096  # blocks of one material that are evaluated at a time
_WARM_UP = 3  # steps before one is recorded: CUDA libraries set themselves up in the first ones
_gate: Any = torch.ops.aten.threshold_backward  # gradient of a ReLU from its output
_recording = threading.Lock()  # a process can record one CUDA graph at a time


def stack_bytes(device: str) -> int:
    """Bytes of samples that make a full stack: 1 GiB; on CUDA 4 GiB or half of what is free."""
    opened = open_device(device)
    if opened.type != "cuda":
        return 1 << 30
    free, _ = torch.cuda.mem_get_info(opened)
    return min(4 << 30, int(free) // 2)


class SampleStack:
    """Samples of several materials of the same inputs on a device."""

    def __init__(self, samples: Sequence[Samples], device: str) -> None:
        counts = [part.block_count for part in samples]
        rows = samples[0].rows
        # Sample by sample, so that a gathered batch is a matrix with one sample per row.
        self.blocks = torch.empty((sum(counts), BLOCK, rows), device=device)
        self.parts = self.blocks.split(counts)
        for target, part in zip(self.parts, samples, strict=True):
            source = torch.from_numpy(part.blocks).view(-1, rows, BLOCK)
            target.copy_(source.to(device).transpose(1, 2))
        starts = np.cumsum([0, *counts[:-1]])[:, None]
        self.starts = torch.from_numpy(starts).to(device)
        self.block_count = min(counts)  # blocks that every material has


class TorchTrainer:
    """Weights and optimizer state of a stack of networks on a PyTorch device: "cpu", "cuda",
    "cuda:1".

    Initial layers of each network are copied; a step takes `batch` samples of each material, a
    multiple of 16. The activation is ReLU or its square. Reflectances are e^x - `offset` for
    outputs x. Raises NacreError if PyTorch has no such device here.
    """

    def __init__(
        self,
        layers: Sequence[Layer],
        batch: int,
        device: str,
        materials: int = 1,
        activation: str = RELU,
        offset: float = 1.0,
    ) -> None:
        if batch < BLOCK or batch % BLOCK:
            raise ValueError(f"batch must be a positive multiple of {BLOCK}, got {batch}")
        self._batch, self._materials = batch // BLOCK, materials
        self._activation, self._offset = activation, offset
        self._device = open_device(device)

        def stacked(array: Weights) -> Tensor:
            one = torch.tensor(array, device=self._device)
            return one.repeat(materials, *[1] * array.ndim)

        self._weights = [stacked(layer.weights) for layer in layers]
        self._biases = [stacked(layer.biases) for layer in layers]
        parameters = self._weights + self._biases
        self._means = [torch.zeros_like(p) for p in parameters]
        self._squares = [torch.zeros_like(p) for p in parameters]
        self._steps = [torch.zeros((), device=self._device) for _ in parameters]
        # What a recorded step reads and writes stays where it is.
        self._outputs = len(layers[-1].biases)
        rows = len(layers[0].weights) + self._outputs + 1
        self._gathered = torch.empty((materials * self._batch, BLOCK, rows), device=self._device)
        self._rate = torch.zeros((), device=self._device)
        cuda = self._device.type == "cuda"
        self._stream = torch.cuda.Stream(self._device) if cuda else None
        self._warm_up = _WARM_UP
        self._graph: Any = None

    def layers(self) -> list[list[Layer]]:
        """Copies of the current layers of every network."""
        return self._layers(self._weights, self._biases)

    def gradient(
        self, samples: SampleStack, order: npt.NDArray[np.int64]
    ) -> tuple[Weights, list[list[Layer]]]:
        """Mean losses over the blocks in an order, shape (materials,), and their gradients.

        The order, of at most one batch, is as in :meth:`epoch`; gradients are layers of networks.
        """
        if order.shape[-1] > self._batch:
            raise ValueError(f"{order.shape[-1]} blocks are more than one batch of {self._batch}")
        blocks = self._gather(samples, torch.from_numpy(order).to(self._device))
        losses = self._losses(blocks, self._weights, self._biases) / (
            self._outputs * blocks.shape[1]
        )
        return np.asarray(losses.cpu()), self._layers(*self._gradient(blocks))

    def epoch(self, samples: SampleStack, order: npt.NDArray[np.int64], rates: Weights) -> None:
        """Take one step per learning rate over the blocks in `order`: indices of shape (blocks,),
        or (materials, blocks) for orders of their own. There is a rate for each batch of the order.
        """
        if self._stream:
            self._stream.wait_stream(torch.cuda.current_stream(self._device))
        with torch.cuda.stream(self._stream):  # has no effect without one
            parts = torch.from_numpy(order).to(self._device).split(self._batch, dim=-1)
            for part, rate in zip(parts, torch.from_numpy(rates).to(self._device), strict=True):
                self._rate.copy_(rate)
                self._step(self._gather(samples, part))
        if self._stream:
            torch.cuda.current_stream(self._device).wait_stream(self._stream)

    def loss(self, samples: SampleStack) -> Weights:
        """Mean losses over all samples, shape (materials,)."""
        losses = []
        for index, blocks in enumerate(samples.parts):
            one = slice(index, index + 1)
            weights, biases = ([p[one] for p in ps] for ps in (self._weights, self._biases))
            parts = (part.view(1, -1, part.shape[-1]) for part in blocks.split(_LOSS_BLOCKS))
            total = torch.cat([self._losses(rows, weights, biases) for rows in parts]).sum()
            losses.append(total / (self._outputs * BLOCK * len(blocks)))
        return np.asarray(torch.stack(losses).cpu())

    def _layers(self, weights: Sequence[Tensor], biases: Sequence[Tensor]) -> list[list[Layer]]:
        arrays = [[p.cpu().numpy() for p in ps] for ps in (weights, biases)]
        return [
            [Layer(w[index].copy(), b[index].copy()) for w, b in zip(*arrays, strict=True)]
            for index in range(self._materials)
        ]

    def _gather(self, samples: SampleStack, order: Tensor) -> Tensor:
        """Chosen blocks of every material, shape (materials, samples, rows)."""
        index = (samples.starts + order).flatten()
        blocks = self._gathered[: len(index)]
        torch.index_select(samples.blocks, 0, index, out=blocks)
        return blocks.view(self._materials, -1, blocks.shape[-1])

    def _step(self, blocks: Tensor) -> None:
        whole = blocks.shape[1] == self._batch * BLOCK
        if self._stream is None or not whole:
            self._update(blocks)
        elif self._warm_up:
            self._warm_up -= 1
            self._update(blocks)
        else:
            self._graph = self._graph or self._record(blocks)
            self._graph.replay()

    def _record(self, blocks: Tensor) -> Any:
        """The step of a whole batch as a CUDA graph; it is not taken yet."""
        graph = torch.cuda.CUDAGraph()
        options = {"stream": self._stream, "capture_error_mode": "thread_local"}
        with _recording, torch.cuda.device(self._device), torch.cuda.graph(graph, **options):
            self._update(blocks)
        return graph

    def _update(self, blocks: Tensor) -> None:
        weights, biases = self._gradient(blocks)
        adam(
            self._weights + self._biases, weights + biases, self._means, self._squares, [],
            self._steps, lr=self._rate, beta1=0.9, beta2=0.999, eps=1e-8, weight_decay=0.0,
            amsgrad=False, maximize=False, fused=True,
        )  # fmt: skip

    def _gradient(self, rows: Tensor) -> tuple[list[Tensor], list[Tensor]]:
        """Gradients of the mean losses; by hand, which takes two thirds of autograd's time."""
        activations = self._forward(rows, self._weights, self._biases)
        weight = rows[..., -1:]
        e, weighted = _weighted(activations.pop(), weight, self._offset)
        # The logarithm of the loss rises, so that it is not needed here.
        side = (weighted - rows[..., -self._outputs - 1 : -1]).sign()
        slope = e if self._offset else e.clamp(min=MIN_SLOPE).where(side < 0.0, e)
        g = side * (weight / (self._outputs * rows.shape[1])) * slope / _argument(weighted, weight)
        weights: list[Tensor] = []
        biases: list[Tensor] = []
        for layer in reversed(range(len(activations))):
            x = activations[layer]
            weights.insert(0, torch.bmm(x.mT, g))
            biases.insert(0, g.sum(1))
            if layer:
                g = torch.bmm(g, self._weights[layer].mT)
                g = g * (2.0 * x.sqrt()) if self._activation == SQUARED_RELU else _gate(g, x, 0.0)
        return weights, biases

    def _forward(
        self, rows: Tensor, weights: Sequence[Tensor], biases: Sequence[Tensor]
    ) -> list[Tensor]:
        """Inputs of every layer, and the outputs, each of shape (materials, samples, width)."""
        activations = [rows[..., : weights[0].shape[1]]]
        for index, layer in enumerate(zip(weights, biases, strict=True), 1):
            activation = self._activation if index < len(weights) else None
            activations.append(dense(activations[-1], layer, activation))
        return activations

    def _losses(self, rows: Tensor, weights: Sequence[Tensor], biases: Sequence[Tensor]) -> Tensor:
        """Sums of |log(1 + (e^x - offset) weight) - log(1 + target)|, shape (materials,)."""
        weight, target = rows[..., -1:], rows[..., -self._outputs - 1 : -1]
        _, weighted = _weighted(self._forward(rows, weights, biases)[-1], weight, self._offset)
        logarithm = torch.copysign(_argument(weighted, weight).log(), weighted)
        return (logarithm - target.log1p()).abs().sum((1, 2))


def _weighted(outputs: Tensor, weight: Tensor, offset: float) -> tuple[Tensor, Tensor]:
    e = outputs.clamp_(max=_LARGEST).exp_()
    return e, (e - offset) * weight


def _argument(weighted: Tensor, weight: Tensor) -> Tensor:
    """The argument of the loss's logarithm.

    As in the kernel: with a weight above 1 the logarithm is the same on both sides of 0, where it
    goes on as -log(1 - u).
    """
    return 1.0 + weighted.abs().where(weight > 1.0, weighted)
