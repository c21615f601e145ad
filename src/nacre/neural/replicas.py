"""The fit of one network on two cores: several starts, then two replicas of the best of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.neural.kernel import KernelTrainer
from nacre.neural.samples import BLOCK, Samples
from nacre.numerics.mlp import RELU, Layer
from nacre.runtime.parallel import core_count, thread_map

REPLICAS = 2
"""However many cores there are, so that the same seed gives the same network on all machines."""
_STEPS = 50  # between two averages: often enough to lose nothing, and rarely enough to cost little


class ReplicaTrainer:
    """A network from the best start, in replicas that are averaged after every few steps.

    For the first `trial` epochs every start trains alone on all samples (0 for the first start
    alone); then the one with the smallest loss on held-out samples goes on, or on those of training
    where there are none. From there each replica takes its own half of the batches at twice the
    learning rate (as for a batch of twice the size: Goyal et al. 2017), and weights and moments are
    averaged (local SGD: Stich 2019). `starts` are the initial layers of each start; `batch`,
    `activation` and `offset` are those of :class:`nacre.neural.kernel.KernelTrainer`, for each
    replica. A trainer holds a thread until it is closed.
    """

    def __init__(
        self,
        starts: Sequence[Sequence[Layer]],
        batch: int,
        activation: str = RELU,
        trial: int = 0,
        held_out: Samples | None = None,
        offset: float = 1.0,
    ) -> None:
        chosen = starts if trial else starts[:1]
        trainers = [KernelTrainer(layers, batch, activation, offset) for layers in chosen]
        self._trainers = trainers if trial else _replicas(trainers[0])
        self._trial, self._held_out = trial, held_out
        self._batch = batch // BLOCK
        self._worker = ThreadPoolExecutor(1) if core_count() > 1 else None

    def __enter__(self) -> ReplicaTrainer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._worker:
            self._worker.shutdown()

    def layers(self) -> list[Layer]:
        """Copies of the current layers; those of the first start before one is chosen."""
        return self._trainers[0].layers()

    def loss(self, samples: Samples) -> float:
        """Mean loss over all samples; that of the first start before one is chosen."""
        return self._trainers[0].loss(samples)

    def epoch(self, samples: Samples, order: npt.NDArray[np.int64], rates: Weights) -> None:
        """Pass once over the blocks in an order; there is a learning rate for each batch of it."""
        if self._trial:
            for _ in thread_map(lambda start: start.epoch(samples, order, rates), self._trainers):
                pass
            self._trial -= 1
            if not self._trial:
                self._trainers = _replicas(self._best(self._held_out or samples))
            return
        steps = -(-len(rates) // REPLICAS)
        for first in range(0, steps, _STEPS):

            def advance(k: int, first: int = first) -> None:
                part = order[k * steps * self._batch : (k + 1) * steps * self._batch]
                blocks = part[first * self._batch :][: _STEPS * self._batch]
                count = -(-len(blocks) // self._batch)
                own = np.float32(REPLICAS) * rates[REPLICAS * first :: REPLICAS][:count]
                self._trainers[k].epoch(samples, blocks, own)

            self._together(advance)
            KernelTrainer.average(self._trainers)

    def _best(self, samples: Samples) -> KernelTrainer:
        losses = np.array(list(thread_map(lambda start: start.loss(samples), self._trainers)))
        return self._trainers[int(np.where(np.isnan(losses), np.inf, losses).argmin())]

    def _together(self, advance: Callable[[int], None]) -> None:
        """Call a function for each replica, on two cores where there are some."""
        if self._worker is None:
            for k in range(REPLICAS):
                advance(k)
            return
        others = [self._worker.submit(advance, k) for k in range(1, REPLICAS)]
        advance(0)
        for other in others:
            other.result()


def _replicas(trainer: KernelTrainer) -> list[KernelTrainer]:
    return [trainer, *(trainer.copy() for _ in range(REPLICAS - 1))]
