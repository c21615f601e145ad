"""Numbers in a range, which help and messages give in words: "1 or more", "0 to 89"."""

from __future__ import annotations

import math
from typing import Any, TypeAlias, TypeVar

import click

_Number = TypeVar("_Number", int, float)
Range: TypeAlias = click.IntRange | click.FloatRange


class IntRange(click.IntRange):
    """Whole numbers in a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        try:
            number = click.INT.convert(value, param, ctx)
        except click.BadParameter:
            self.fail(f"expected a whole number ({in_words(self)}), got {value!r}", param, ctx)
        return _inside(self, number, param, ctx)


class FiniteRange(click.FloatRange):
    """Finite numbers in a range; click lets "nan" pass everywhere, and "inf" in open ranges."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        try:
            number = click.FLOAT.convert(value, param, ctx)
        except click.BadParameter:
            number = math.nan
        if math.isnan(number):
            self.fail(f"expected a number ({in_words(self)}), got {value!r}", param, ctx)
        number = _inside(self, number, param, ctx)
        if math.isinf(number):
            self.fail(f"expected a finite number, got {value}", param, ctx)
        return number


def positive(most: float | None = None) -> FiniteRange:
    return FiniteRange(0.0, most, min_open=True)


SEED = IntRange(0, (1 << 32) - 1)
"""Some of the libraries that draw random numbers take 32 bits only."""


def in_words(kind: Range) -> str:
    """A range as a colleague would say it; empty if there is none.

    >>> in_words(IntRange(1)), in_words(FiniteRange(0.0, 89.0)), in_words(positive(1e6))
    ('1 or more', '0 to 89', 'above 0, up to 1,000,000')
    """
    least, most = kind.min, kind.max
    if least is not None and most is not None and not kind.min_open and not kind.max_open:
        return f"{number_in_words(least)} to {number_in_words(most)}"
    parts = []
    if least is not None:
        number = number_in_words(least)
        parts.append(f"above {number}" if kind.min_open else f"{number} or more")
    if most is not None:
        parts.append(f"{'below' if kind.max_open else 'up to'} {number_in_words(most)}")
    return ", ".join(parts)


def number_in_words(number: float) -> str:
    """A number with commas, and without a fraction of zero: "1,000,000", "0.1", "45", "1e+12"."""
    return f"{number:,.15g}" if abs(number) < 1e10 else f"{number:g}"


def _inside(
    kind: Range, number: _Number, param: click.Parameter | None, ctx: click.Context | None
) -> _Number:
    low = kind.min is not None and (number <= kind.min if kind.min_open else number < kind.min)
    high = kind.max is not None and (number >= kind.max if kind.max_open else number > kind.max)
    if low or high:
        kind.fail(f"expected {in_words(kind)}, got {number_in_words(number)}", param, ctx)
    return number
