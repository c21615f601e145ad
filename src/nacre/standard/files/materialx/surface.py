"""What a kind of surface is to a reader of MaterialX, and what readers share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from nacre.analytic.model import AnalyticBrdf
from nacre.errors import FormatError
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import Color, Input

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)

Values: TypeAlias = Mapping[str, Any]
"""Inputs by name, those that a file does not give with their defaults."""

Turns: TypeAlias = Mapping[str, float]
"""Angles in radians that a file turns tangents by, from +x toward +y."""


@dataclass(frozen=True)
class Surface:
    """A kind of surface, and how it is read."""

    definitions: Mapping[str, Mapping[str, Input]]
    """Defaults that differ from :attr:`defaults`, by the names of the `nodedef`."""
    defaults: Mapping[str, Input]
    ignored: frozenset[str]
    """Inputs that change nothing about an opaque surface in light without shadows."""
    normals: tuple[str, ...]
    tangents: tuple[str, ...]
    read: Callable[[Values, Turns, str | None, OpaquePart], AnalyticBrdf]
    """The material of inputs, tangents and :func:`nacre.standard.files.facts.facts_of`.

    Raises FormatError if a value is out of bounds.
    """


def opaque_color(
    color: str,
    metallic: str,
    through: str,
    values: Values,
    opaque: OpaquePart,
    called: str | None = None,
) -> Color:
    """The color of a base whose diffuse part is as much smaller as it transmits light."""
    found, metal = as_color(values[color]), values[metallic]
    if metal == 1.0:
        return found
    kept = opaque.share(called or through, values[through], "transmission", "left out")
    if kept == 1.0:
        return found
    if metal:
        raise FormatError(
            f"{metallic} is {metal:g}: no part of a metal transmits; set it to 0 or 1"
        )
    return as_color([kept * c for c in found])


def no_light(name: str, color: Color, opaque: OpaquePart) -> None:
    if any(color):
        opaque.without(f"{name}: emission is not read", "set it to 0", "Emission is left out.")


def as_color(values: Any) -> Color:
    red, green, blue = values
    return red, green, blue
