from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.readings import (
    alternatives,
    azimuth_options,
    chosen,
    color_options,
    loaded,
    note_known,
    report_colors,
)


@make(
    "45-0",
    options.argument("path", metavar="INPUT"),
    *color_options(),
    *azimuth_options(),
    writes=False,
    reads=True,
)
def command(
    path: Path, illuminant: str, observer: str, standard: Path | None, azimuth: float
) -> None:
    """Read the color of a reflectance at 45:0, which leaves the mirrored light out (CIE 15).

    45a:0 has light from all around, 45x:0 from one azimuth.
    """
    from nacre.instruments import bidirectional

    materials, _ = loaded(path, standard)
    settings = chosen(illuminant, observer, azimuth)
    found, *other = (bidirectional(brdf, **settings) for brdf in materials)
    colors, *others = ([each.annular, each.directional] for each in (found, *other))
    facts = {"known_fraction": found.known}
    read = [bidirectional(brdf, **settings) for brdf in alternatives(materials[0])]
    plausible = [[each.annular, each.directional] for each in read]
    names = ["45a:0", "45x:0"]
    report_colors(path, names, colors, others[0] if others else None, facts, plausible)
    note_known(min(each.known for each in (found, *other)))
