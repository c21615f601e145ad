"""Small bases of made materials."""

from __future__ import annotations

import itertools
from functools import cache, partial
from typing import Any

import numpy as np

from nacre.analytic import Ggx
from nacre.latent import Autoencoder, Hypernetwork, LobePredictor, NeuralBasis, PcaBasis, PcaRecipe
from nacre.latent.hypernetwork import COLUMN, HIDDEN_COUNT
from nacre.latent.weights import COUNT
from nacre.measured.merl import Resolution
from nacre.neural import Layer
from nacre.neural.nbrdf import HIDDEN
from nacre.neural.training import initial_layers
from nacre.numerics.mlp import flat_weights
from nacre.runtime.progress import Progress
from nacre.sampling.parametrizations import PARAMETRIZATIONS

GRID = Resolution(24, 12, 12)


def material(seed: int) -> Ggx:
    random = np.random.default_rng(seed)
    return Ggx(
        name=f"made {seed}",
        diffuse=tuple(random.uniform(0.02, 0.6, 3)),
        specular=tuple(random.uniform(0.02, 0.9, 3)),
        roughness=random.uniform(0.15, 0.6),
    )


MATERIALS = [partial(material, seed) for seed in range(8)]
NEW = material(100)


@cache
def basis(code_dim: int = 6, separate: bool = False) -> PcaBasis:
    return PcaBasis.train(MATERIALS, PcaRecipe(code_dim, GRID, separate))


@cache
def random_basis(luma: int = 4, pairs: int = 1) -> NeuralBasis:
    """A neural basis that nothing has trained."""
    random = np.random.default_rng(3)
    hidden = [
        Layer(random.normal(0.0, 0.6, shape), random.normal(0.0, 0.3, shape[1]))
        for shape in ((6, 12), (12, 10))
    ]
    functions = random.normal(0.0, 0.3, (11, 1 + luma + pairs)).astype(np.float32)
    examples = random.normal(size=(5, luma + 2 * pairs)).astype(np.float32)
    return NeuralBasis(hidden, functions, luma, examples, {"about": "random"})


def random_layer(
    random: np.random.Generator, rows: int, columns: int, deviation: float, biases: Any = 0.0
) -> Layer:
    return Layer(random.normal(0.0, deviation, (rows, columns)), biases + np.zeros(columns))


@cache
def random_autoencoder(values: int = 6) -> Autoencoder:
    """An autoencoder that nothing has trained."""
    random = np.random.default_rng(5)
    start = flat_weights(initial_layers(HIDDEN, 0))
    start[-3:] = 2.0  # f_r above 0 everywhere
    return Autoencoder(
        start,
        random_layer(random, COUNT, 8, 0.2),
        random_layer(random, 8, values, 0.5),
        random_layer(random, values, 8, 0.5),
        random_layer(random, 8, COUNT, 0.05, start),
        seed=2,
        metadata={"about": "random"},
    )


@cache
def random_hypernetwork(luma: int = 4, pairs: int = 1) -> Hypernetwork:
    """A hypernetwork that nothing has trained."""
    random = np.random.default_rng(4)

    start = flat_weights(initial_layers(HIDDEN, 0))[:HIDDEN_COUNT]
    return Hypernetwork(
        random_basis(luma, pairs),
        random_layer(random, luma + pairs, 8, 0.5),
        random_layer(random, luma + 8, HIDDEN_COUNT, 0.05, start),
        random_layer(random, 8 + pairs, 8, 0.4),
        random_layer(random, luma + pairs + 8, COLUMN, 0.05, 0.3),
        {"about": "random"},
    )


def predictor(family: str, values: int = 6, scale: float = 1.0, seed: int = 5) -> LobePredictor:
    """A predictor that nothing has trained."""
    random = np.random.default_rng(seed)
    sizes = (values, 8, PARAMETRIZATIONS[family].size)
    layers = [
        Layer(scale * random.normal(size=shape), scale * random.normal(size=shape[1]))
        for shape in itertools.pairwise(sizes)
    ]
    return LobePredictor(family, layers)


def stop_at(step: int, stage: str = "training") -> Progress:
    """Progress that interrupts a training."""

    def report(reached: str, done: int, total: int, note: str) -> None:
        if reached == stage and done >= step:
            raise KeyboardInterrupt

    return report
