from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from nacre.cli.options import option

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.instruments import Color


def _angles(text: str) -> tuple[float, ...]:
    degrees = options.floats(text)
    if len(degrees) > 20 or not all(0.0 <= angle <= 89.0 for angle in degrees):
        raise ValueError("expected up to 20 degrees from 0 to 89, like 0,30,60")
    return degrees


@make(
    "sphere",
    options.argument("path", metavar="INPUT"),
    option("--incidence", options.Parsed("DEG,DEG", _angles), metavar="DEG,DEG", shown="none"),
    "Also read the directional-hemispherical reflectance, for light at these angles from the "
    "normal.",
    *color_options(),
    *azimuth_options(),
    writes=False,
    reads=True,
)
def command(
    path: Path,
    incidence: tuple[float, ...] | None,
    illuminant: str,
    observer: str,
    standard: Path | None,
    azimuth: float,
) -> None:
    """Read the color of a reflectance in an integrating sphere (CIE 15).

    di:8 includes the light that a mirror would reflect, de:8 leaves it out; 60:di is all that is
    reflected of light at 60 degrees.
    """
    materials, _ = loaded(path, standard)
    settings = chosen(illuminant, observer, azimuth)
    (colors, known), *other = (_colors(brdf, incidence or (), settings) for brdf in materials)
    names = ["di:8", "de:8", *(f"{angle:g}:di" for angle in incidence or ())]
    standards = other[0][0] if other else None
    plausible = [_colors(b, incidence or (), settings)[0] for b in alternatives(materials[0])]
    report_colors(path, names, colors, standards, {"known_fraction": known}, plausible)
    note_known(min(known, *(share for _, share in other)) if other else known)


def _colors(
    brdf: Brdf, incidence: tuple[float, ...], settings: dict[str, Any]
) -> tuple[list[Color], float]:
    """All readings of a material, and the share of directions at which it is known."""
    from nacre.instruments import directional_hemispherical, sphere

    found = sphere(brdf, **settings)
    beams = [directional_hemispherical(brdf, angle, **settings) for angle in incidence]
    return [found.included, found.excluded, *beams], found.known
