"""Functions of parameters alone."""

from __future__ import annotations

from nacre.array import Array, namespace


def of_numbers(name: str, *values: Array) -> Array:
    """A function of :class:`nacre.array.Namespace`, by name, applied to parameters.

    For plain numbers the result is a plain number: NumPy's scalars would turn float32 arrays into
    double, and plain numbers become literals in compiled code.
    """
    found = getattr(namespace(*values), name)(*values)
    return float(found) if all(isinstance(value, float | int) for value in values) else found


def bounded(value: Array, low: float, high: float) -> Array:
    return of_numbers("minimum", of_numbers("maximum", value, low), high)


def largest(color: tuple[Array, Array, Array]) -> Array:
    red, green, blue = color
    return of_numbers("maximum", of_numbers("maximum", red, green), blue)
