"""Formulas on pairs of vectors as machine code whose parameters may change between calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Table, Weights
from nacre.compile.trace import Traced
from nacre.compile.vectorized import VectorFunction


class AdjustableFunction:
    """A formula of named parameters and two vectors, compiled once for all values of these.

    The `formula`, from parameters by name and two vectors to a vector, is called once. `shapes` are
    those of the parameters: () for a number, (3,) for a color, which the formula takes as a tuple,
    (rows, nodes) for a table. Not for several threads at a time: the parameters of a call are kept
    in the object. Raises what :class:`nacre.compile.vectorized.VectorFunction` raises.
    """

    def __init__(
        self,
        formula: Callable[[Mapping[str, Any], Components, Components], Components],
        shapes: Mapping[str, tuple[int, ...]],
    ) -> None:
        self._places = {name: np.zeros(shape, np.float32) for name, shape in shapes.items()}

        def traced(a: Components, b: Components) -> tuple[tuple[Components], Array]:
            values = {name: _traced(place, a[0]) for name, place in self._places.items()}
            return (formula(values, a, b),), a[0] != a[0]

        self._run = VectorFunction(traced)

    def __call__(
        self,
        values: Mapping[str, npt.ArrayLike],
        a: Weights,
        b: Weights,
    ) -> Weights:
        """The vectors, shape (n, 3), for n pairs of shape (n, 3), contiguous."""
        for name, place in self._places.items():
            place[...] = values[name]
        (found,), _ = self._run(a, b)
        return found


def _traced(place: Weights, like: Traced) -> Any:
    """A stand-in for numbers that are not known yet: they are gathered from where they will be."""
    if place.ndim == 2:
        return Table(place)
    table = Table(place.reshape(-1))
    trace = like.trace
    numbers = [
        trace.add("float", "take", trace.table(table.values), trace.index(k))
        for k in range(place.size)
    ]
    return tuple(numbers) if place.ndim else numbers[0]
