"""A command of another package: `nacre brightness FILE` prints how much light a material reflects.

Its entry point, in `pyproject.toml`:

    [project.entry-points."nacre.commands"]
    brightness = "nacre_example.command:command"

What a command needs is imported when it runs, so that `nacre help` stays fast.
"""

from __future__ import annotations

import math
from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.ranges import FiniteRange
from nacre.cli.report import report_facts


@make(
    "brightness",
    options.argument("path"),
    options.option("--incidence", FiniteRange(0.0, 89.0), default=0.0, metavar="DEG"),
    "Angle between the light and the normal, in degrees.",
    writes=False,
)
def command(path: Path, incidence: float) -> None:
    """Print which part of the light from one direction a material reflects."""
    import nacre
    from nacre.metrics.physics import albedo

    red, green, blue = albedo(nacre.load(path), math.radians(incidence)).value.tolist()
    report_facts(path.name, {"red": red, "green": green, "blue": blue})
