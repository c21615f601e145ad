"""The fit on a CUDA card, an epoch per launch: steps of :mod:`nacre.neural.torch` in one kernel.

A step of one network is less work than launching it. Here a cluster of thread blocks trains a
network, and keeps its weights and the samples of a batch in shared memory (`steps.cu`).
"""

from __future__ import annotations

import itertools
import math
import os
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.errors import reason
from nacre.neural.samples import BLOCK, MIN_SLOPE
from nacre.neural.torch import SampleStack, Tensor, TorchTrainer, torch
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer, flat_weights, widths
from nacre.runtime import cuda_kernel
from nacre.runtime.cuda_kernel import Card, CudaError, CudaKernel
from nacre.runtime.device import open_device

_CLUSTERS = 90  # compute capability from which blocks of threads can share their memory
_PARTS = 4, 2, 1
_THREADS = 256, 128, 64, 32  # each has one sample at a time
_FEWEST = 128  # samples that are worth a block of threads
_TOLERANCE = 1e-3  # of the largest gradient, between this kernel's and PyTorch's


class Launch(NamedTuple):
    """How a stack is spread over a card."""

    parts: int  # blocks of threads per network
    threads: int  # per block
    shared: int  # bytes of shared memory per block


class StepsTrainer(TorchTrainer):
    """A stack on a CUDA card whose epochs are one launch each.

    See :class:`nacre.neural.torch.TorchTrainer`. It warns, and takes the steps of that, where the
    kernel cannot be compiled or launched, the network is too large for it, or its first gradient is
    not that of PyTorch.
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
        super().__init__(layers, batch, device, materials, activation, offset)
        self.steps = 0
        """Adam steps taken, which it corrects its moments by."""
        self._sizes = widths(layers)
        # The kernel finds weights and moments in one array, in which the tensors of layers are.
        size = len(flat_weights(layers))
        self._state = torch.zeros((3, materials * size), device=self._device)
        parameters = [p for pair in zip(self._weights, self._biases, strict=True) for p in pair]
        parts = self._state.split([p.numel() for p in parameters], dim=1)
        views = [part.view(3, *p.shape) for part, p in zip(parts, parameters, strict=True)]
        for view, p in zip(views, parameters, strict=True):
            view[0] = p
        self._weights, self._biases = [v[0] for v in views[::2]], [v[0] for v in views[1::2]]
        self._means, self._squares = ([v[k] for v in views[::2] + views[1::2]] for k in (1, 2))
        self._kernel: CudaKernel | None = None
        try:
            with self._context():
                self._kernel, self._launch = self._compiled()
        except CudaError as error:
            self._give_up(reason(error))

    def epoch(self, samples: SampleStack, order: npt.NDArray[np.int64], rates: Weights) -> None:
        """See :meth:`nacre.neural.torch.TorchTrainer.epoch`."""
        if self._kernel and not self.steps:
            self._try(self._kernel, samples, order, rates)
        if not self._kernel:
            super().epoch(samples, order, rates)
            return
        self._take(self._kernel, self._state, samples, order, rates)
        self.steps += len(rates)

    def _take(
        self, kernel: CudaKernel, state: Tensor, samples: SampleStack,
        order: npt.NDArray[np.int64], rates: Weights,
    ) -> None:  # fmt: skip
        steps = self.steps + np.arange(1, len(rates) + 1)
        schedule = np.stack([rates / (1.0 - 0.9**steps), 1.0 / (1.0 - 0.999**steps)], axis=1)
        with self._context():
            own = torch.from_numpy(np.ascontiguousarray(order, np.int32)).to(self._device)
            factors = torch.from_numpy(schedule.astype(np.float32)).to(self._device)
            count = order.shape[-1]
            kernel.launch(
                self._materials * self._launch.parts, self._launch.threads, self._current_stream(),
                samples.blocks, samples.starts, own, count, count * (order.ndim - 1), factors,
                len(rates), state,
            )  # fmt: skip

    def _try(
        self, kernel: CudaKernel, samples: SampleStack, order: npt.NDArray[np.int64], rates: Weights
    ) -> None:
        """Give the kernel up unless its first gradient is that of PyTorch."""
        part, state = order[..., : self._batch], self._state.clone()
        try:
            self._take(kernel, state, samples, part, rates[:1])
        except CudaError as error:
            self._give_up(reason(error))
            return
        gathered = self._gather(samples, torch.from_numpy(part).to(self._device))
        pairs = zip(*self._gradient(gathered), strict=True)
        expected = torch.cat([p.flatten() for pair in pairs for p in pair])
        # A first moment is a tenth of the first gradient. What is not finite tells nothing.
        off = (10.0 * state[1] - expected).abs().where(expected.isfinite(), 0.0).max()
        if not off <= _TOLERANCE * expected.abs().where(expected.isfinite(), 0.0).max():
            self._give_up(f"the kernel's gradient is off by {float(off):.2g}")

    def _give_up(self, why: str) -> None:
        self._kernel = None
        warnings.warn(
            f"device '{self._device}': each step is launched by itself, which is slower: {why}",
            RuntimeWarning,
            stacklevel=3,
        )

    def _compiled(self) -> tuple[CudaKernel, Launch]:
        functions = cuda_kernel.library()
        card = Card(functions)
        launch = _launch(self._sizes, self._batch, self._materials, card)
        macros = {
            "WIDTHS": ", ".join(map(str, self._sizes)),
            "THREADS": launch.threads,
            "PARTS": launch.parts,
            "BATCH": self._batch,
            "SQUARED": int(self._activation == SQUARED_RELU),
            "OFFSET": int(self._offset),
            "MIN_SLOPE": f"{MIN_SLOPE}f",
            "SHARED": launch.shared,
        }
        source = Path(__file__).with_name("steps.cu").read_text("utf-8")
        shared, capability = launch.shared, card.capability
        return CudaKernel(source, "train", macros, capability, shared, functions), launch

    def _context(self) -> AbstractContextManager[Any]:
        on_card = self._device.type == "cuda"
        return torch.cuda.device(self._device) if on_card else nullcontext()

    def _current_stream(self) -> int:
        on_card = self._device.type == "cuda"
        return torch.cuda.current_stream(self._device).cuda_stream if on_card else 0


def _launch(sizes: Sequence[int], batch: int, materials: int, card: Card) -> Launch:
    """Spread a stack of networks with batches of so many blocks of samples over a card.

    Raises CudaError if a network does not fit into the shared memory.
    """
    clustered = card.capability >= _CLUSTERS
    most = min(card.multiprocessors // materials, batch * BLOCK // _FEWEST) if clustered else 1
    parts = next(n for n in _PARTS if n <= max(1, most))
    share = math.ceil(batch / parts) * BLOCK
    for threads in _THREADS:
        shared = _shared_bytes(sizes, parts, threads)
        if shared <= card.shared_memory and (threads < 2 * share or threads == _THREADS[-1]):
            return Launch(parts, threads, shared)
    raise CudaError(
        f"a network of {'-'.join(map(str, sizes))} units does not fit into the shared memory of "
        f"{card.shared_memory} bytes"
    )


def _shared_bytes(sizes: Sequence[int], parts: int, threads: int) -> int:
    """The size of `Shared` in `steps.cu`, which the compiler there compares."""
    pairs = list(itertools.pairwise(sizes))
    parameters = sum((a + 1) * b for a, b in pairs)
    tiles = sum(math.ceil((a + 1) / 8) * math.ceil(b / 3) for a, b in pairs)
    rows = sizes[0] + sizes[-1] + 1 + sum(sizes[1:-1]) + sum(sizes[1:]) + 1
    copies = 3 + max(1, threads // tiles) + (2 if parts > 1 else 0)
    return 4 * (rows * (threads + 4) + copies * parameters)


def stack_trainer(
    layers: Sequence[Layer], batch: int, device: str, materials: int, activation: str, offset: float
) -> TorchTrainer:
    """The trainer of a stack on a device, of arguments as of :class:`TorchTrainer`.

    On CUDA cards it is :class:`StepsTrainer` where the environment has ``NACRE_CUDA_EPOCHS=1``: its
    kernel has never run on a card, and one that hangs cannot be given up.
    """
    asked = os.environ.get("NACRE_CUDA_EPOCHS") == "1"
    fused = asked and open_device(device).type == "cuda" and torch.version.cuda
    kind = StepsTrainer if fused else TorchTrainer
    return kind(layers, batch, device, materials, activation, offset)
