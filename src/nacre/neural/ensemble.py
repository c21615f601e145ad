"""Networks that the noise of a scan leaves as plausible as the one that was fitted to it.

Each begins with weights of its own and is trained briefly on samples moved by noise of their own:
they differ as fits to repeated measurements would, and where there is no sample, as networks do
(Lakshminarayanan et al. 2017, "Simple and Scalable Predictive Uncertainty Estimation using Deep
Ensembles"; the noise is the parametric bootstrap of Efron and Tibshirani 1993).
"""

from __future__ import annotations

import base64
import itertools
from dataclasses import replace

import numpy as np

from nacre.errors import NacreError
from nacre.neural.kernel import KernelTrainer
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.recipe import Recipe
from nacre.neural.scattered import clamped, highest, scattered_samples
from nacre.neural.training import epochs, initial_layers
from nacre.numerics.direction_samples import Scattered
from nacre.numerics.mlp import flat_weights, shaped_layers
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress, silent

COUNT = 16

_SAMPLES = 40_000  # five times as many where the material is anisotropic
_BATCH, _EPOCHS, _RATE = 256, 100, 1e-2
_STORED = np.dtype("<f2")


def plausible(
    network: NeuralBrdf, scan: Scattered, progress: Progress = silent
) -> list[NeuralBrdf]:
    """Networks as plausible as one that was fitted to a scan.

    The noise of a sample is the same in all channels. Raises NacreError if it is not known.
    """
    sigma, settings = scan.samples.sigma, network.metadata["fit"]
    if sigma is None:
        raise NacreError(
            f"{scan.name or 'scan'}: intervals need its uncertainties: a column sigma, for example"
        )
    hidden, split = settings["hidden"], (settings["held_out"], settings["seed"])
    recipe = Recipe(epochs=_EPOCHS, learning_rate=_RATE, batch=_BATCH, seed=settings["seed"])
    count = _SAMPLES if scan.isotropic else 5 * _SAMPLES

    def moved(index: int) -> NeuralBrdf:
        random = np.random.default_rng((recipe.seed, 10, index))
        noise = sigma * random.normal(size=len(sigma))
        samples = replace(scan.samples, rgb=scan.samples.rgb + noise[:, None])
        noisy = scan.with_samples(samples)
        training, _ = scattered_samples(noisy, count, *split, inputs=network.inputs)
        start = initial_layers(hidden, recipe.seed, training.inputs, index + 1)
        trainer = KernelTrainer(start, _BATCH, network.activation)
        for _ in epochs(trainer, training, recipe):
            pass
        return network.with_layers(clamped(trainer.layers(), highest(noisy, *split)))

    found = []
    for other in thread_map(moved, range(COUNT)):
        found.append(other)
        progress("intervals", len(found), COUNT, "")
    return found


def stored(network: NeuralBrdf, others: list[NeuralBrdf]) -> str:
    """How the weights of others differ from those of a network, as text for JSON."""
    own = flat_weights(network.layers)
    moved = np.stack([flat_weights(other.layers) - own for other in others]).astype(_STORED)
    return base64.b64encode(moved.tobytes()).decode("ascii")


def restored(network: NeuralBrdf, text: str) -> list[NeuralBrdf]:
    """The networks of :func:`stored`; ValueError if the text is none of such weights."""
    own, shapes = flat_weights(network.layers), list(itertools.pairwise(network.sizes))
    moved = np.frombuffer(base64.b64decode(text, validate=True), _STORED).reshape(-1, len(own))
    if not np.isfinite(moved).all():
        raise ValueError("weights are not finite")
    return [network.with_layers(shaped_layers(own + other, shapes)) for other in moved]
