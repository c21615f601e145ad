"""Mixed derivatives by each of three variables at most once, carried along a formula.

A jet holds the derivatives of a value by sets of variables, each set a bit mask: 0 the value
itself, 1, 2 and 4 the derivatives by one variable, 7 that by all three. Sums, products and
functions of jets follow from Leibniz's rule and Faa di Bruno's over partitions of the set. What a
jet holds may be arrays of any library, or numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, reduce
from operator import mul
from typing import Any

ALL = tuple(range(8))
"""Every set of the three variables."""


class Jet:
    """A value with derivatives by the sets of variables that are its keys."""

    def __init__(self, parts: Mapping[int, Any]) -> None:
        self.parts = dict(parts)

    @classmethod
    def variable(cls, value: Any, bit: int, sets: Sequence[int] = ALL) -> Jet:
        """A variable itself: its derivative is 1 by that bit, and 0 by all others."""
        zero = 0.0 * value
        return cls({key: value if key == 0 else zero + float(key == bit) for key in sets})

    def __add__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet(
                {key: part + other if key == 0 else part for key, part in self.parts.items()}
            )
        return Jet({key: part + other.parts[key] for key, part in self.parts.items()})

    def __mul__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet({key: part * other for key, part in self.parts.items()})
        return Jet(
            {
                key: _total([self.parts[some] * other.parts[key ^ some] for some in _subsets(key)])
                for key in self.parts
            }
        )

    def through(self, derivatives: Sequence[Any], sets: Sequence[int] | None = None) -> Jet:
        """A function of the jet, from its value and first derivatives there, one per variable.

        `sets` are those to find; all that the jet has where None.
        """
        parts = {}
        for key in self.parts if sets is None else sets:
            by_order: dict[int, list[Any]] = {}
            for blocks in _partitions(key):
                factors = [self.parts[block] for block in blocks]
                by_order.setdefault(len(blocks), []).append(reduce(mul, factors) if blocks else 1.0)
            parts[key] = _total([derivatives[k] * _total(sums) for k, sums in by_order.items()])
        return Jet(parts)


def _total(terms: Sequence[Any]) -> Any:
    return reduce(lambda a, b: a + b, terms)


@cache
def _subsets(key: int) -> tuple[int, ...]:
    return tuple(some for some in range(key + 1) if some & key == some)


@cache
def _partitions(key: int) -> tuple[tuple[int, ...], ...]:
    """The partitions of a set into sets that are not empty; the empty set has one, of none."""
    if not key:
        return ((),)
    lowest = key & -key
    found: list[tuple[int, ...]] = []
    for some in _subsets(key ^ lowest):
        rest = key ^ lowest ^ some
        found += [(some | lowest, *others) for others in _partitions(rest)]
    return tuple(found)
