"""Options for what an instrument can measure."""

from __future__ import annotations

from typing import Any

import click

from nacre.cli import options
from nacre.cli.layout import Option
from nacre.cli.options import option
from nacre.cli.ranges import FiniteRange

_GROUP = "the instrument"


def _field(text: str) -> tuple[float, ...]:
    edges = options.floats(text)
    if len(edges) != 2:
        raise ValueError("expected a width and a height in degrees, like 12,8")
    return edges


def instrument_options() -> list[Option | str]:
    """Rows of a command; their values go to :func:`instrument`."""
    return [
        option("--max-polar", FiniteRange(1.0, 89.0), default=80.0, metavar="DEG", group=_GROUP),
        "Largest angle of the light and the detector from the normal.",
        option("--min-angle", FiniteRange(0.0, 170.0), default=10.0, metavar="DEG", group=_GROUP),
        "Smallest angle between light and detector at which neither shades the other.",
        option(
            "--fixed-light", FiniteRange(0.0, 89.0), metavar="DEG", group=_GROUP, shown="it moves"
        ),
        "Angle of a fixed light from the normal.",
        option("--in-plane", group=_GROUP, is_flag=True),
        "Keep the detector in the plane of the light and the normal.",
        option("--step", FiniteRange(0.01, 15.0), default=0.1, metavar="DEG", group=_GROUP),
        "Step of the axes; all angles are multiples of it.",
        option(
            "--field",
            options.Parsed("W,H", _field),
            metavar="W,H",
            group=_GROUP,
            shown="one direction",
        ),
        "Size of a camera's picture in degrees, seen from the sample. A picture makes nine rows: "
        "corners, middles of edges, center.",
    ]


def instrument(chosen: dict[str, Any]) -> Any:
    from nacre.measuring import Instrument

    try:
        return Instrument(**chosen)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
