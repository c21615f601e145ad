"""The fit of one network on two cores: several starts, then two replicas of the best of them."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from types import TracebackType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.neural.kernel import KernelTrainer
from nacre.neural.samples import BLOCK, Samples
from nacre.numerics.mlp import RELU, Layer
from nacre.runtime.parallel import free_cores, thread_map

REPLICAS = 2
"""However many cores there are, so that the same seed gives the same network on all machines."""
_STEPS = 50  # between two averages: often enough to lose nothing, and rarely enough to cost little
_PIECE = 10  # steps after which a thread that does the other's work looks whether that is done
_PATIENCE = 0.25  # of the time that its own steps took, before it does so


class ReplicaTrainer:
    """A network from the best start, in replicas that are averaged after every few steps.

    For the first `trial` epochs every start trains alone on all samples (0 for the first start
    alone); then the one with the smallest loss on held-out samples goes on, or on those of training
    where there are none. From there each replica takes its own half of the batches at twice the
    learning rate (as for a batch of twice the size: Goyal et al. 2017), and weights and moments are
    averaged (local SGD: Stich 2019). `starts` are the initial layers of each start; `batch`,
    `activation` and `offset` are those of :class:`nacre.neural.kernel.KernelTrainer`, for each
    replica. A trainer holds a thread until it is closed.

    Where another process takes a core, the thread on it stops in the middle of its steps. The other
    thread then does them as well, from the same state, rather than wait: both come to the same
    bits, so the load decides nothing but the time.
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
        self._trainers = [KernelTrainer(layers, batch, activation, offset) for layers in chosen]
        self._trial, self._held_out = trial, held_out
        self._batch = batch // BLOCK
        self._thread = ThreadPoolExecutor(1) if free_cores() > 1 else None
        if not trial:
            self._choose(self._trainers[0])

    def _choose(self, trainer: KernelTrainer) -> None:
        """Go on from one start: with a replica here, and one for either thread to advance."""
        self._trainers = [trainer]
        self._own, self._others = trainer.copy(), trainer.copy()
        self._second_steps = trainer.steps
        self._late: Future[None] | None = None

    def __enter__(self) -> ReplicaTrainer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._thread:
            self._thread.shutdown()

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
                self._choose(self._best(self._held_out or samples))
            return
        steps = -(-len(rates) // REPLICAS)
        for first in range(0, steps, _STEPS):
            parts = []
            for k in range(REPLICAS):
                part = order[k * steps * self._batch : (k + 1) * steps * self._batch]
                blocks = part[first * self._batch :][: _STEPS * self._batch]
                count = -(-len(blocks) // self._batch)
                own = np.float32(REPLICAS) * rates[REPLICAS * first :: REPLICAS][:count]
                parts.append(_Part(samples, blocks, own))
            self._stretch(*parts)

    def _stretch(self, first: _Part, second: _Part) -> None:
        """Advance both replicas from the same state, and average them."""
        replica, spare, its = self._trainers[0], self._own, self._others
        spare.follow(replica, self._second_steps)
        began, future = time.perf_counter(), None
        if self._thread and (self._late is None or self._late.done()):
            its.follow(replica, self._second_steps)
            future = self._late = self._thread.submit(its.epoch, *second)
        replica.epoch(*first)
        if future is None:
            spare.epoch(*second)
        elif not self._overtake(future, spare, second, time.perf_counter() - began):
            future.result()
            spare = its
        replica.average(spare)
        self._second_steps += len(second.rates)

    def _overtake(
        self, future: Future[None], spare: KernelTrainer, part: _Part, spent: float
    ) -> bool:
        """Do the other thread's steps unless it is done with them soon; whether all were done."""
        wait([future], _PATIENCE * spent)
        for piece in part.pieces(_PIECE, self._batch):
            if future.done():
                return False
            spare.epoch(*piece)
        return True

    def _best(self, samples: Samples) -> KernelTrainer:
        losses = np.array(list(thread_map(lambda start: start.loss(samples), self._trainers)))
        return self._trainers[int(np.where(np.isnan(losses), np.inf, losses).argmin())]


class _Part(NamedTuple):
    """What a replica trains on between two averages: arguments of its `epoch`."""

    samples: Samples
    order: npt.NDArray[np.int64]
    rates: Weights

    def pieces(self, steps: int, batch: int) -> Iterator[_Part]:
        """The same in pieces of a few steps, of so many blocks each."""
        for k in range(0, len(self.rates), steps):
            blocks = self.order[k * batch : (k + steps) * batch]
            yield _Part(self.samples, blocks, self.rates[k : k + steps])
