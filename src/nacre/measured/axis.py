"""Linear interpolation between tables measured at the nodes of a parameter.

Runs on components from any array library, like the formulas that use it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy.typing as npt

from nacre.array import Array, Table, namespace

Blend: TypeAlias = Sequence[tuple[Array, Array]]
"""Slice indices and the weights, summing to 1, with which their values are added."""

KNOWN = 1.0 - 1e-5
"""Weight of valid nodes from which an interpolated value counts as valid: absorbs rounding."""
LEAST_KNOWN = 1e-18
"""Least weight of known nodes to divide by; float32 holds its inverse squared, as slopes need."""


class Axis:
    """Nodes of one parameter, strictly increasing; a single one makes the parameter irrelevant."""

    def __init__(self, nodes: npt.ArrayLike) -> None:
        self.nodes = Table(nodes)

    def __len__(self) -> int:
        return len(self.nodes.values)

    def blend(self, value: Array) -> Blend:
        """Neighboring nodes and their weights; constant beyond the ends."""
        xp = namespace(value)
        zero = zero_index(value)
        if len(self) == 1:
            return [(zero, 1.0)]
        index = bisect(lambda i: xp.take(self.nodes, i), value, zero, len(self) - 1)
        low, high = xp.take(self.nodes, index), xp.take(self.nodes, index + 1)
        weight = xp.minimum(xp.maximum((value - low) / (high - low), 0.0), 1.0)
        return [(index, 1.0 - weight), (index + 1, weight)]


def zero_index(like: Array) -> Array:
    """Index 0 in the shape and library of `like`, whatever numbers that holds."""
    xp = namespace(like)
    return xp.to_index(xp.where(like == like, 0.0 * like, 0.0))


def cell(position: Array, count: int) -> tuple[Array, Array]:
    """Which of `count` steps a non-negative position is in, and how far along it, up to 1."""
    xp = namespace(position)
    index = xp.maximum(xp.minimum(xp.to_index(position), count - 1), 0)
    return index, xp.minimum(position - xp.to_float(index, position), 1.0)


def outer(slow: Blend, fast: Blend, fast_count: int) -> Blend:
    """Blend over two parameters, slices being numbered `slow * fast_count + fast`."""
    return [(i * fast_count + j, v * w) for i, v in slow for j, w in fast]


def bisect(fetch: Callable[[Array], Array], value: Array, zero: Array, count: int) -> Array:
    """Largest index in [0, count) whose entry is below `value`; 0 where none is.

    `fetch` gives the entry at an index; entries do not decrease. `zero` is index 0 in the shape and
    type of the result. The steps taken depend on `count` only, so they trace into a kernel.
    """
    xp = namespace(value)
    index = zero
    for bit in reversed(range((count - 1).bit_length())):
        candidate = xp.minimum(index + (1 << bit), count - 1)
        index = xp.where(fetch(candidate) < value, candidate, index)
    return index
