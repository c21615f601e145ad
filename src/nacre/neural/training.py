"""The training loop: a schedule of Adam steps, on whatever trains a network."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.neural.nbrdf import OUTPUTS
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK
from nacre.numerics.direction_samples import loss_scale
from nacre.numerics.mlp import Layer
from nacre.runtime.progress import Progress


class Blocks(Protocol):
    @property
    def block_count(self) -> int:
        """Number of blocks of each material."""


_Samples = TypeVar("_Samples", bound=Blocks)
_SamplesIn = TypeVar("_SamplesIn", bound=Blocks, contravariant=True)
_Loss = TypeVar("_Loss", float, Weights)
_LossOut = TypeVar("_LossOut", float, Weights, covariant=True)


class Trainer(Protocol[_SamplesIn, _LossOut]):
    """Weights and optimizer state on some device: of one network, or a stack with a loss each."""

    def epoch(self, samples: _SamplesIn, order: npt.NDArray[np.int64], rates: Weights) -> None:
        """Take one Adam step per learning rate over blocks in the given order."""

    def loss(self, samples: _SamplesIn) -> _LossOut:
        """Mean loss over all samples."""


def train(
    trainer: Trainer[_Samples, _Loss],
    training: _Samples,
    held_out: _Samples,
    recipe: Recipe,
    progress: Progress | None = None,
) -> dict[str, _Loss]:
    """Run the schedule of a recipe; returns the training and held-out losses at its end."""
    report_every = max(1, recipe.epochs // 20)
    losses: dict[str, _Loss] = {}
    for epoch in epochs(trainer, training, recipe):
        last = epoch + 1 == recipe.epochs
        if last or (progress and epoch % report_every == 0):
            losses["held_out_loss"] = trainer.loss(held_out)
        if progress:
            median = _median(losses["held_out_loss"])
            note = f"held-out loss {median:.5f} ({loss_scale(recipe.loss_gain)})"
            progress("training", epoch + 1, recipe.epochs, note)
    return {"training_loss": trainer.loss(training), **losses}


def epochs(trainer: Trainer[_Samples, _Loss], training: _Samples, recipe: Recipe) -> Iterator[int]:
    """Run the schedule of a recipe an epoch at a time, yielding each from 0 when it is done."""
    batch_blocks = recipe.batch // BLOCK
    steps = -(-training.block_count // batch_blocks)
    rates = schedule(steps * recipe.epochs, recipe.learning_rate)
    random = np.random.default_rng((recipe.seed, 1))
    for epoch in range(recipe.epochs):
        order = random.permutation(training.block_count)
        trainer.epoch(training, order, rates[epoch * steps : (epoch + 1) * steps])
        yield epoch


def _median(losses: npt.ArrayLike) -> float:
    """The median loss of a stack, where those that diverged are the largest."""
    return float(np.sort(losses, axis=None)[np.size(losses) // 2])


def schedule(steps: int, peak: float) -> Weights:
    """Learning rate of every step: linear warm-up over 2 %, then a cosine to zero."""
    step = np.arange(steps)
    warm_up = max(1, steps // 50)
    decay = np.clip((step - warm_up) / max(1, steps - warm_up), 0.0, 1.0)
    rate = peak * np.minimum((step + 1) / warm_up, 0.5 + 0.5 * np.cos(math.pi * decay))
    return rate.astype(np.float32)


def initial_layers(
    hidden: Sequence[int], seed: int, inputs: int = 6, start: int = 0, outputs: int = OUTPUTS
) -> list[Layer]:
    """Normal weights of variance 2 / inputs (He et al. 2015), new for each start; zero biases."""
    random = np.random.default_rng((seed, 2, start) if start else (seed, 2))
    return [
        Layer(
            random.normal(0.0, math.sqrt(2.0 / rows), (rows, columns)).astype(np.float32),
            np.zeros(columns, np.float32),
        )
        for rows, columns in itertools.pairwise((inputs, *hidden, outputs))
    ]
