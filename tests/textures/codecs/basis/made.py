"""A small codec with random weights."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from nacre.numerics.mlp import Layer
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.functions import INPUTS, AngularFunctions
from nacre.textures.codecs.basis.posterior import Prior
from nacre.textures.codecs.basis.recipe import BasisRecipe
from nacre.textures.codecs.basis.skip_network import SkipNetwork

TINY = BasisRecipe(values=2, greys=3, chromas=2, width=6, depth=2, wide=8, hidden=5, completing=7)


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
    functions = sizes.greys + sizes.chromas
    count = functions + sizes.chromas
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
        AngularFunctions(hidden, wide, last, sizes.greys),
        network(count, count, 2 * count, sizes.completing),
        network(count, sizes.values, count),
        network(sizes.values, count, sizes.values),
        prior,
        metadata or {},
    )
