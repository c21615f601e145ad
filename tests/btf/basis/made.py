"""A small codec with random weights."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from nacre.btf.basis.codec import BasisCodec
from nacre.btf.basis.functions import INPUTS, AngularFunctions
from nacre.btf.basis.posterior import Prior
from nacre.btf.basis.skip_network import SkipNetwork
from nacre.layer import Layer

GREYS, CHROMAS, VALUES = 3, 2, 2
COEFFICIENTS = GREYS + 2 * CHROMAS


def layers(random: Any, *sizes: int) -> list[Layer]:
    return [
        Layer(random.normal(size=(a, b)) / np.sqrt(a), 0.1 * random.normal(size=b))
        for a, b in itertools.pairwise(sizes)
    ]


def codec(seed: int = 0, metadata: dict[str, Any] | None = None) -> BasisCodec:
    """Of two values, five functions and seven coefficients."""
    random = np.random.default_rng(seed)
    *hidden, wide, last = layers(random, INPUTS, 6, 6, 8, 1 + GREYS + CHROMAS)
    last.biases[0] = 1.0
    prior = Prior(
        np.linspace(1.0, 0.5, COEFFICIENTS, dtype=np.float32),
        0.01,
        np.eye(COEFFICIENTS, dtype=np.float32),
        0.01,
    )

    def network(inputs: int, outputs: int, seen: int) -> SkipNetwork:
        linear = random.normal(size=(inputs, outputs)).astype(np.float32)
        return SkipNetwork(linear, layers(random, seen, 5, 4, outputs))

    return BasisCodec(
        AngularFunctions(hidden, wide, last, GREYS),
        network(COEFFICIENTS, VALUES, 2 * COEFFICIENTS),
        network(VALUES, COEFFICIENTS, VALUES),
        prior,
        metadata or {},
    )
