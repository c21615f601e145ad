"""Networks of 675 weights that all start from one network, so that their weights can be compared.

Neurons may change places and trade scale without any change of f_r, and fits that start anywhere
end anywhere. A short fit from one common network keeps its neurons what they are; the shorter it
is, the less its weights depend on anything but the material.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nacre.array import Weights
from nacre.latent.directions import isotropic_inputs, shared_directions
from nacre.latent.recipes import GAIN
from nacre.latent.weights import network_layers
from nacre.neural.inputs import PAPER
from nacre.neural.nbrdf import HIDDEN, OUTPUTS
from nacre.neural.recipe import Recipe
from nacre.neural.samples import Samples
from nacre.neural.training import initial_layers, train
from nacre.numerics.mlp import Layer, flat_weights
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress

DIRECTIONS = 1 << 15  # pairs of directions at which materials are seen
EPOCHS = 10  # of a short fit: 40 come twice as close, but their codes are half as good
_BEGINNING = Recipe(inputs=PAPER, epochs=100)
_LEARNING_RATE = 1e-3  # of a short fit
_HELD_OUT = 0.05
_MIN, _MAX = 1e-4, 1e4  # of f_r in 1/sr where logarithms are mixed
_PARTS = 4  # of a mixture, at most
_EXAGGERATION = 0.5, 1.6  # how far weights of a mixture are from even ones, relative to a mean
_ALONE = 0.7, 1.2  # the same of a single material, relative to the mean of all
_BRIGHTNESS = 0.15  # standard deviation of what is added to the logarithm of a mixture


class Distillation:
    """Fits of networks to materials that are known at the same directions.

    The seed chooses the directions and the network that the first fit starts from; `epochs` are
    those of a material's fit.
    """

    def __init__(self, seed: int, epochs: int = EPOCHS) -> None:
        self.seed = seed
        self._short = Recipe(inputs=PAPER, epochs=epochs, learning_rate=_LEARNING_RATE)
        self.wi, self.wo = shared_directions(DIRECTIONS, seed)
        self._inputs = isotropic_inputs(self.wi, self.wo, PAPER)

    def common(self, f_r: Sequence[Weights]) -> Weights:
        """Weights of a network of what is common to materials, shape (675,), the same by channel.

        That is the mean of ln(f_r + 1) over materials and channels. Each `f_r` is in 1/sr, shape
        (directions, 3), and negative where not known.
        """
        logs = np.mean([np.log1p(np.maximum(f, 0.0)).mean(axis=1) for f in f_r], axis=0)
        luma = np.repeat(np.expm1(logs)[:, None], 3, axis=1).astype(np.float32)
        *hidden, last = self._fit(initial_layers(HIDDEN, self.seed), luma, _BEGINNING)
        # Any mean of outputs that are alike is like them.
        matrix, bias = last.weights.mean(axis=1), last.biases.mean()
        alike = Layer(np.repeat(matrix[:, None], 3, axis=1), np.full(3, bias))
        return flat_weights([*hidden, alike])

    def weights(self, common: Weights, f_r: Weights) -> Weights:
        """Weights of a material's network that starts from the common one, shape (675,)."""
        return flat_weights(self._fit(network_layers(common), f_r, self._short))

    def networks(
        self, common: Weights, f_r: Sequence[Weights], mixtures: int, report: Progress
    ) -> Weights:
        """Weights (n, 675) of networks of two or more materials, then of mixtures of them."""
        total, found = len(f_r) + mixtures, []
        mean = _mean_logarithm(f_r)

        def fitted(index: int) -> Weights:
            known = index < len(f_r)
            return self.weights(
                common, f_r[index] if known else _mixture(f_r, mean, (self.seed, 5, index))
            )

        for weights in thread_map(fitted, range(total)):
            found.append(weights)
            report("networks", len(found), total, "")
        return np.stack(found)

    def _fit(self, layers: Sequence[Layer], f_r: Weights, recipe: Recipe) -> list[Layer]:
        from nacre.neural.kernel import KernelTrainer

        known = f_r[:, 0] >= 0.0
        samples = Samples.pack(self._inputs[known], f_r[known], GAIN * self.wi[known, 2])
        trainer = KernelTrainer(layers, recipe.batch)
        train(trainer, *samples.split(_HELD_OUT), recipe)
        return trainer.layers()


def _mean_logarithm(rows: Sequence[Weights]) -> Weights:
    """Mean of ln f_r over channels and the materials that are known, shape (directions, 1)."""
    total = np.zeros((len(rows[0]), 1), np.float32)
    count = np.zeros_like(total)
    for row in rows:
        known = row[:, :1] >= 0.0
        total += np.where(known, _logarithm(row).mean(axis=1, keepdims=True), 0.0)
        count += known
    return np.asarray(total / np.maximum(count, 1.0), np.float32)


def _mixture(rows: Sequence[Weights], mean: Weights, seed: tuple[int, ...]) -> Weights:
    """f_r of a mixture of one to four materials in the logarithm, each with its channels permuted.

    Weights add up to 1, and some may be negative: new materials are not between known ones. A
    single material's weight is near 1, about the mean of all.
    """
    random = np.random.default_rng(seed)
    count = min(int(random.integers(1, _PARTS + 1)), len(rows))
    chosen = random.permutation(len(rows))[:count]
    if count == 1:
        weights = random.uniform(*_ALONE, size=1)
    else:
        even = 1.0 / count
        weights = even + (random.dirichlet(np.ones(count)) - even) * random.uniform(*_EXAGGERATION)
    mixed = mean + random.normal(0.0, _BRIGHTNESS)
    known = np.ones(mean.shape, np.bool_)
    for weight, index in zip(weights, chosen, strict=True):
        row = rows[index][:, random.permutation(OUTPUTS)]
        mixed = mixed + weight * (_logarithm(row) - mean)
        known &= row[:, :1] >= 0.0
    f_r = np.exp(np.minimum(mixed, math.log(_MAX)))
    return np.where(known, f_r, -1.0).astype(np.float32)


def _logarithm(f_r: Weights) -> Weights:
    return np.log(np.maximum(f_r, _MIN))
