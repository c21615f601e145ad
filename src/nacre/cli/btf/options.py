"""Options and arguments of several commands on textures."""

from __future__ import annotations

import click

pixels_option = click.option(
    "--pixels",
    type=click.Choice(["reflectance", "radiance"]),
    help="What images of a folder hold: the reflectance factor, relative to white under the same "
    "light, or radiance for one irradiance perpendicular to the beam, which has the cosine of the "
    "light in it. Default: what the list of directions says, else reflectance.",
)
