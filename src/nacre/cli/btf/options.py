"""Options and arguments of several commands on textures."""

from __future__ import annotations

import math

import click

pixels_option = click.option(
    "--pixels",
    type=click.Choice(["reflectance", "radiance"]),
    help="What images of a folder hold: the reflectance factor, relative to white under the same "
    "light, or radiance for one irradiance perpendicular to the beam, which has the cosine of the "
    "light in it. Default: what the list of directions says, else reflectance.",
)


def angles(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> tuple[float, float] | None:
    """A polar angle and an azimuth, as an option's callback."""
    if value is None:
        return None
    try:
        theta, phi = (float(part) for part in value.split(","))
    except ValueError:
        theta, phi = math.nan, math.nan
    if not (0.0 <= theta < 90.0 and math.isfinite(phi)):
        raise click.BadParameter("expected a polar angle below 90 and an azimuth, like 30,180")
    return theta, phi
