"""Networks of 675 weights that all begin at one network, so that their weights can be compared.

Neurons may change places and trade scale without any change of f_r, and fits that begin anywhere
end anywhere. A short fit from one common network keeps its neurons what they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nacre.latent.directions import Floats, isotropic_inputs, shared_directions
from nacre.latent.recipes import GAIN
from nacre.latent.weights import flat_weights, network_layers
from nacre.neural.inputs import PAPER
from nacre.neural.nbrdf import HIDDEN, OUTPUTS
from nacre.neural.recipe import Recipe
from nacre.neural.samples import Samples
from nacre.neural.training import initial_layers, train
from nacre.numerics.mlp import Layer
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress

DIRECTIONS = 1 << 15  # pairs of directions at which materials are seen
_BEGINNING = Recipe(epochs=100)
_SHORT = Recipe(epochs=40, learning_rate=1e-3)
_HELD_OUT = 0.05
_MIN = 1e-4  # of f_r, where geometric means are taken


class Distillation:
    """Fits of networks to materials that are known at the same directions.

    The seed is that of the directions and of the network that the first fit begins at.
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.wi, self.wo = shared_directions(DIRECTIONS, seed)
        self._inputs = isotropic_inputs(self.wi, self.wo, PAPER)

    def common(self, f_r: Sequence[Floats]) -> Floats:
        """Weights of a network of what is common to materials, shape (675,), the same by channel.

        That is the mean of ln(f_r + 1) over materials and channels, of which `f_r` is in 1/sr,
        shape (directions, 3) each, and negative where not known.
        """
        logs = np.mean([np.log1p(np.maximum(f, 0.0)).mean(axis=1) for f in f_r], axis=0)
        luma = np.repeat(np.expm1(logs)[:, None], 3, axis=1).astype(np.float32)
        *hidden, last = self._fit(initial_layers(HIDDEN, self.seed), luma, _BEGINNING)
        # Any mean of outputs that are alike is like them.
        matrix, bias = last.weights.mean(axis=1), last.biases.mean()
        alike = Layer(np.repeat(matrix[:, None], 3, axis=1), np.full(3, bias))
        return flat_weights([*hidden, alike])

    def weights(self, common: Floats, f_r: Floats) -> Floats:
        """Weights of a material's network that begins at the common one, shape (675,)."""
        return flat_weights(self._fit(network_layers(common), f_r, _SHORT))

    def networks(
        self, common: Floats, f_r: Sequence[Floats], mixtures: int, report: Progress
    ) -> Floats:
        """Weights (n, 675) of networks of two or more materials, then of geometric means of two."""
        total, found = len(f_r) + mixtures, []

        def fitted(index: int) -> Floats:
            known = index < len(f_r)
            return self.weights(common, f_r[index] if known else _mixture(f_r, index, self.seed))

        for weights in thread_map(fitted, range(total)):
            found.append(weights)
            report("networks", len(found), total, "")
        return np.stack(found)

    def _fit(self, layers: Sequence[Layer], f_r: Floats, recipe: Recipe) -> list[Layer]:
        from nacre.neural.kernel import KernelTrainer

        known = f_r[:, 0] >= 0.0
        samples = Samples.pack(self._inputs[known], f_r[known], GAIN * self.wi[known, 2])
        trainer = KernelTrainer(layers, recipe.batch)
        train(trainer, *samples.split(_HELD_OUT), recipe)
        return trainer.layers()


def _mixture(rows: Sequence[Floats], index: int, seed: int) -> Floats:
    """A geometric mean of two materials, of which one has its channels permuted."""
    random = np.random.default_rng((seed, 5, index))
    first, second = random.permutation(len(rows))[:2]
    fraction, permutation = random.random(), random.permutation(OUTPUTS)
    one, other = rows[first], rows[second][:, permutation]
    logs = [np.log(np.maximum(f, _MIN)) for f in (one, other)]
    mixed = np.exp((1.0 - fraction) * logs[0] + fraction * logs[1])
    known = (one[:, :1] >= 0.0) & (other[:, :1] >= 0.0)
    return np.where(known, mixed, -1.0).astype(np.float32)
