"""Parameters of standard models, and functions of parameters alone."""

from __future__ import annotations

from nacre.analytic.model import Parameter
from nacre.array import Array, namespace

GRAZING = 1e-6
"""Models clamp the cosines of directions to this; results for lower ones are ignored."""


def fraction(name: str, start: tuple[float, float] = (0.05, 0.95)) -> Parameter:
    """A number from 0 to 1; fits start within `start`."""
    return Parameter(name, 0.0, 1.0, start)


WIDE_GAMUT = (-2.0, 4.0)
"""Range in Rec. 709 of colors from 0 to 1 in any color space that files name."""


def color_parameter(name: str, start: tuple[float, float] = (0.02, 0.9)) -> Parameter:
    """A color from 0 to 1, or what one in another color space is; fits start within `start`."""
    return Parameter(name, 0.0, 1.0, start, color=True, allowed=WIDE_GAMUT)


def of_numbers(name: str, *values: Array) -> Array:
    """A function of :class:`nacre.array.Namespace`, by name, applied to parameters.

    For plain numbers the result is a plain number: NumPy's scalars would turn float32 arrays into
    double, and plain numbers become literals in compiled code.
    """
    found = getattr(namespace(*values), name)(*values)
    return float(found) if all(isinstance(value, float | int) for value in values) else found


def bounded(value: Array, low: float, high: float) -> Array:
    return of_numbers("minimum", of_numbers("maximum", value, low), high)


def largest(channels: tuple[Array, Array, Array]) -> Array:
    red, green, blue = channels
    return of_numbers("maximum", of_numbers("maximum", red, green), blue)
