"""How commands show what instruments would read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nacre.instruments.readings import Reading
    from nacre.measuring.predictions import Prediction


def table(
    readings: Sequence[Reading], predictions: Sequence[Prediction]
) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of what was read and what is expected; intervals of colors are of L*."""
    read = {reading.quantity: reading.values for reading in readings}
    rows = []
    for each in predictions:
        quantity = each.quantity
        unit = quantity.unit or " ".join(quantity.components)
        expected = numbers(each.expected)
        within = f"{numbers(each.low[:1])} to {numbers(each.high[:1])}"
        rows.append([quantity.name, unit, numbers(read.get(quantity, ())), expected, within])
    return ["quantity", "unit", "read", "expected", "90 % within"], rows


def numbers(values: Sequence[float]) -> str:
    """Values with one digit behind the point, or two where they are below 1."""
    return " ".join(f"{v + 0.0:.1f}" if abs(v) >= 1.0 else f"{v + 0.0:.2f}" for v in values)


def facts(prediction: Prediction) -> dict[str, Any]:
    """A prediction as JSON."""
    quantity = prediction.quantity
    return {
        "instrument": quantity.instrument,
        "geometry": quantity.geometry,
        "values": list(quantity.components),
        "expected": list(prediction.expected),
        "low": list(prediction.low),
        "high": list(prediction.high),
    }
