"""Smooth functions of a light and a view, whose weighted sums are apparent BRDFs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, namespace
from nacre.geometry import dot, half_vector, split, stereographic
from nacre.numerics.mlp import Layer

_CHUNK = 1 << 12
"""Pairs of directions at a time."""
_SHARPEST = 0.005
"""Added to the sine of half-vector angles, so that their logarithm is bounded."""
INPUTS = 12
"""Of the network."""


class FunctionValues(NamedTuple):
    """The functions at n pairs of directions."""

    mean: Floats
    """What all texels have, shape (n,)."""
    grey: Floats
    """Shape (n, grays)."""
    chroma: Floats
    """Shape (n, chromas)."""

    def at(self, chosen: npt.NDArray[np.intp]) -> FunctionValues:
        """The values at some of the pairs."""
        return FunctionValues(self.mean[chosen], self.grey[chosen], self.chroma[chosen])


@dataclass(frozen=True, eq=False)
class AngularFunctions:
    """Functions that a network gives for a pair of directions.

    All layers but the last are followed by x / (1 + exp(-x)); of the hidden ones, all but the first
    add to what came before them. Roots of reflectance are sums of the functions, as gray values and
    pairs, see :mod:`nacre.textures.codecs.basis.colors`.

    Parameters
    ----------
    hidden
        Layers of one width.
    wide
        A layer after those: the more units, the better the last one can combine them.
    last
        Gives the mean, then functions of gray values, then those of pairs.
    grays
        How many of the functions are for gray values.

    Raises
    ------
    ValueError
        If layers do not chain, or `grays` is out of range.
    """

    hidden: Sequence[Layer]
    wide: Layer
    last: Layer
    greys: int

    def __post_init__(self) -> None:
        width = INPUTS
        for layer in [*self.hidden, self.wide, self.last]:
            if layer.weights.shape != (width, len(layer.biases)):
                raise ValueError(f"a layer of shape {layer.weights.shape} follows {width} values")
            width = len(layer.biases)
        if not 0 < self.greys < width or len({len(h.biases) for h in self.hidden}) != 1:
            raise ValueError(f"{self.greys} of {width - 1} functions are gray")

    @property
    def chromas(self) -> int:
        """How many of the functions are for pairs."""
        return len(self.last.biases) - 1 - self.greys

    def __call__(self, wi: Floats, wo: Floats) -> FunctionValues:
        """The functions at pairs of unit directions, shapes (n, 3)."""
        chunks = [
            self._values(direction_inputs(wi[i : i + _CHUNK], wo[i : i + _CHUNK]))
            for i in range(0, len(wi), _CHUNK)
        ]
        values = np.concatenate(chunks) if chunks else np.empty((0, len(self.last.biases)))
        mean, grey, chroma = np.split(values, [1, 1 + self.greys], axis=1)
        return FunctionValues(mean[:, 0].copy(), np.ascontiguousarray(grey), chroma.copy())

    def _values(self, inputs: Floats) -> Floats:
        first, *others = self.hidden
        state = silu(inputs @ first.weights + first.biases)
        for layer in others:
            state = state + silu(state @ layer.weights + layer.biases)
        state = silu(state @ self.wide.weights + self.wide.biases)
        return state @ self.last.weights + self.last.biases


def silu(x: Floats) -> Floats:
    """X / (1 + exp(-x))."""
    return x / (1.0 + np.exp(-np.clip(x, -60.0, 60.0)))


def direction_inputs(wi: Floats, wo: Floats) -> Floats:
    """What the network sees of pairs of directions: shape (n, :data:`INPUTS`), about within -2..2.

    Stereographic light, view and half vector, which have no pole to be rough at; the cosines; and
    logarithms of the angles between light and view and between half vector and normal, in which
    highlights of any width are smooth.
    """
    a, b = split(wi.astype(np.float64)), split(wo.astype(np.float64))
    return np.stack(direction_components(a, b), axis=-1).astype(np.float32)


def direction_components(wi: Components, wo: Components) -> list[Array]:
    """The same of components of any array library, as a list."""
    xp = namespace(*wi, *wo)
    half = half_vector(wi, wo)
    cosine = xp.minimum(xp.maximum(dot(wi, wo), -1.0), 1.0)
    return [
        *(1.5 * c for w in (wi, wo, half) for c in stereographic(w)),
        *(2.0 * w[2] - 1.0 for w in (wi, wo, half)),
        cosine,
        xp.log(_SHARPEST + 1.0 - half[2]) / 2.0 + 1.5,
        xp.log(_SHARPEST + 1.0 - cosine) / 2.0 + 1.0,
    ]
