"""A small codec with random weights."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from nacre.numerics.mlp import Layer
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.networks import INPUTS, AngularFunctions, SkipNetwork
from nacre.textures.codecs.basis.posterior import Prior
from nacre.textures.codecs.basis.recipe import BasisRecipe

TINY = BasisRecipe(
    code_dim=2, luma_count=3, chroma_count=2, width=6, depth=2, wide=8, hidden=5, completing=7
)


def layers(random: Any, *sizes: int) -> list[Layer]:
    return [
        Layer(random.normal(size=(a, b)) / np.sqrt(a), 0.1 * random.normal(size=b))
        for a, b in itertools.pairwise(sizes)
    ]


def codec(
    seed: int = 0, metadata: dict[str, Any] | None = None, sizes: BasisRecipe = TINY
) -> BasisCodec:
    """Of two values, five functions and seven coefficients, or of other sizes."""
    random = np.random.default_rng(seed)
    functions = sizes.luma_count + sizes.chroma_count
    count = functions + sizes.chroma_count
    widths = [sizes.width] * sizes.depth
    *hidden, wide, last = layers(random, INPUTS, *widths, sizes.wide, 1 + functions)
    last.biases[0] = 1.0
    prior = Prior(
        np.linspace(1.0, 0.5, count, dtype=np.float32), 0.01, np.eye(count, dtype=np.float32), 0.01
    )

    def network(inputs: int, outputs: int, seen: int, width: int = sizes.hidden) -> SkipNetwork:
        linear = random.normal(size=(inputs, outputs)).astype(np.float32)
        return SkipNetwork(linear, layers(random, seen, width, width, outputs))

    return BasisCodec(
        AngularFunctions(hidden, wide, last, sizes.luma_count),
        network(count, count, 2 * count, sizes.completing),
        network(count, sizes.code_dim, count),
        network(sizes.code_dim, count, sizes.code_dim),
        prior,
        metadata or {},
    )
