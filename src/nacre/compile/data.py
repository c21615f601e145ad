"""Numbers in an object as data of compiled code, rather than a part of it."""

from __future__ import annotations

import copy
import dataclasses
import itertools
import operator
from collections.abc import Callable
from typing import Any


def with_numbers(parameters: Any, number: Callable[[float], Any]) -> Any:
    """A sampler, or another dataclass, with a function applied to each of its numbers.

    What may be None stays as it is: formulas look at it before they are traced.
    """
    if isinstance(parameters, float):
        return number(parameters)
    if isinstance(parameters, tuple):
        return tuple(with_numbers(value, number) for value in parameters)
    if isinstance(parameters, type) or not dataclasses.is_dataclass(parameters):
        return parameters
    made = copy.copy(parameters)
    for field in dataclasses.fields(parameters):
        if "None" not in str(field.type):
            changed = with_numbers(getattr(parameters, field.name), number)
            object.__setattr__(made, field.name, changed)
    return made


def as_data(parameters: Any) -> Any:
    """A copy of a dataclass whose numbers are known by their places, not by their values."""
    places = itertools.count()
    return with_numbers(parameters, lambda value: Datum(value, next(places)))


class Datum(float):
    """A number and where it comes from: what is computed from it is computed once, in double.

    Formulas that differ only in the values of such numbers are one formula to a trace.
    """

    origin: Any

    def __new__(cls, value: float, origin: Any) -> Datum:
        made = super().__new__(cls, value)
        made.origin = origin
        return made

    def __neg__(self) -> Datum:
        return Datum(-float(self), ("neg", self.origin))


def computed(name: str, function: Callable[..., float], *values: float) -> float:
    """A function of numbers; its value is a datum where one of them is."""
    result = float(function(*map(float, values)))
    if not any(isinstance(value, Datum) for value in values):
        return result
    return Datum(result, (name, *(getattr(value, "origin", float(value)) for value in values)))


def _operator(name: str, swapped: bool) -> Callable[[Datum, Any], Any]:
    function = getattr(operator, name)

    def method(self: Datum, other: Any) -> Any:
        if not isinstance(other, float | int):
            return NotImplemented
        return computed(name, function, *((other, self) if swapped else (self, other)))

    return method


for _name in ("add", "sub", "mul", "truediv"):
    setattr(Datum, f"__{_name}__", _operator(_name, False))
    setattr(Datum, f"__r{_name}__", _operator(_name, True))
