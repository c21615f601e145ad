"""Networks that the noise of a scan leaves as plausible as the one that was fitted to it.

Each goes on from that network, on samples moved by noise of their own (parametric bootstrap: Efron
and Tibshirani 1993, "An Introduction to the Bootstrap", chapter 6) and by a factor for what the
network cannot follow: they differ from it as it may differ from the truth.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from nacre.errors import NacreError
from nacre.neural.kernel import KernelTrainer
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK
from nacre.neural.scattered import MIN_VALUE, clamped, highest, scattered_samples, unclamped
from nacre.neural.training import epochs
from nacre.numerics.direction_samples import DirectionSamples, Scattered
from nacre.numerics.mlp import Layer
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress, silent

COUNT = 16

_SAMPLES = 40_000
_SETTINGS: dict[str, Any] = {"epochs": 30, "learning_rate": 5e-3, "starts": 1}
"""Of the training that goes on from the network."""
_STORED = np.dtype("<f2")
_COMMON = 0.3
"""Part of what a network cannot follow that all directions have in common: in fits to simulated
scans, albedos err by so much of it."""
_MEDIAN = 0.6745  # median of the size of a normal number with a standard deviation of 1


def plausible(
    network: NeuralBrdf, scan: Scattered, progress: Progress = silent
) -> list[NeuralBrdf]:
    """Networks as plausible as one that was fitted to a scan.

    The noise of a sample is the same in all channels, the factor the same for all samples. Raises
    NacreError if the noise is not known.
    """
    settings = network.metadata.get("fit", {})
    sigma, common = scan.samples.sigma, _COMMON * unexplained(network, scan.samples)
    if sigma is None:
        raise NacreError(
            f"{scan.name or 'scan'}: intervals need its uncertainties: a column sigma, for example"
        )
    recipe = replace(Recipe(**{k: settings[k] for k in ("held_out", "seed")}), **_SETTINGS)
    layers = unclamped(network.layers)
    batch = max(BLOCK, recipe.batch // (2 * BLOCK) * BLOCK)

    def moved(index: int) -> NeuralBrdf:
        random = np.random.default_rng((recipe.seed, 10, index))
        noise = sigma * random.normal(size=len(sigma))
        factor = np.exp(common * random.normal(size=3))
        rgb = factor * (scan.samples.rgb + noise[:, None])
        noisy = scan.with_samples(replace(scan.samples, rgb=rgb))
        split = recipe.held_out, recipe.seed
        training, _ = scattered_samples(noisy, _SAMPLES, *split, inputs=network.inputs)
        trainer = KernelTrainer(layers, batch, network.activation)
        for _ in epochs(trainer, training, replace(recipe, batch=batch)):
            pass
        return network.with_layers(clamped(trainer.layers(), highest(noisy, *split)))

    found = []
    for other in thread_map(moved, range(COUNT)):
        found.append(other)
        progress("intervals", len(found), COUNT, "")
    return found


def unexplained(network: NeuralBrdf, samples: DirectionSamples) -> float:
    """Standard deviation of ln f_r between a network and held-out samples that is not their noise.

    From the median error in its metadata.
    """
    error = float(network.metadata.get("quality", {}).get("held_out_median_error", 0.0)) / _MEDIAN
    level = np.maximum(samples.rgb, MIN_VALUE).mean(axis=1)
    noise = 0.0 if samples.sigma is None else float(np.median(samples.sigma / level))
    return math.sqrt(max(error**2 - noise**2, 0.0))


def stored(network: NeuralBrdf, others: list[NeuralBrdf]) -> str:
    """How the weights of others differ from those of a network, as text for JSON."""
    own = _flat(network.layers)
    moved = np.stack([_flat(other.layers) - own for other in others]).astype(_STORED)
    return base64.b64encode(moved.tobytes()).decode("ascii")


def restored(network: NeuralBrdf, text: str) -> list[NeuralBrdf]:
    """The networks of :func:`stored`; ValueError if the text is none of such weights."""
    own = _flat(network.layers)
    moved = np.frombuffer(base64.b64decode(text, validate=True), _STORED).reshape(-1, len(own))
    if not np.isfinite(moved).all():
        raise ValueError("weights are not finite")
    return [network.with_layers(_layers(own + other, network)) for other in moved]


def _flat(layers: Sequence[Layer]) -> np.ndarray[Any, np.dtype[np.float32]]:
    return np.concatenate([np.ravel(array) for array in chain(*layers)]).astype(np.float32)


def _layers(flat: Any, network: NeuralBrdf) -> list[Layer]:
    """Layers of the shapes of a network's."""
    ends = np.cumsum([array.size for array in chain(*network.layers)])
    parts = np.split(flat, ends[:-1])
    shaped = [
        part.reshape(array.shape) for part, array in zip(parts, chain(*network.layers), strict=True)
    ]
    return [Layer(*pair) for pair in zip(shaped[::2], shaped[1::2], strict=True)]
