"""Functions of parameters alone."""

from __future__ import annotations

from nacre.array import Array, namespace


def of_numbers(name: str, *values: Array) -> Array:
    """A function of :class:`nacre.array.Namespace` by name, of parameters.

    It is a plain number where they are: NumPy's scalars would make float32 arrays double, and plain
    numbers become literals of compiled code.
    """
    found = getattr(namespace(*values), name)(*values)
    return float(found) if all(isinstance(value, float | int) for value in values) else found


def bounded(value: Array, low: float, high: float) -> Array:
    """A parameter between bounds."""
    return of_numbers("minimum", of_numbers("maximum", value, low), high)


def largest(color: tuple[Array, Array, Array]) -> Array:
    """The largest channel."""
    red, green, blue = color
    return of_numbers("maximum", of_numbers("maximum", red, green), blue)
