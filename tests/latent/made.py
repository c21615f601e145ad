"""Small bases of made materials."""

from __future__ import annotations

import itertools
from functools import cache, partial

import numpy as np

from nacre.analytic import Ggx
from nacre.latent import Basis, LobePredictor, NeuralBasis, train
from nacre.measured.merl import Resolution
from nacre.neural import Layer
from nacre.sampling.families import FAMILIES

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
def basis(values: int = 6, separate: bool = False) -> Basis:
    return train(MATERIALS, values, GRID, separate=separate)


@cache
def random_basis(greys: int = 4, pairs: int = 1) -> NeuralBasis:
    """A neural basis that nothing has trained."""
    random = np.random.default_rng(3)
    hidden = [
        Layer(random.normal(0.0, 0.6, shape), random.normal(0.0, 0.3, shape[1]))
        for shape in ((6, 12), (12, 10))
    ]
    functions = random.normal(0.0, 0.3, (11, 1 + greys + pairs)).astype(np.float32)
    return NeuralBasis(hidden, functions, greys, {"about": "random"})


def predictor(family: str, values: int = 6, scale: float = 1.0, seed: int = 5) -> LobePredictor:
    """A predictor that nothing has trained."""
    random = np.random.default_rng(seed)
    sizes = (values, 8, FAMILIES[family].size)
    layers = [
        Layer(scale * random.normal(size=shape), scale * random.normal(size=shape[1]))
        for shape in itertools.pairwise(sizes)
    ]
    return LobePredictor(family, layers)
