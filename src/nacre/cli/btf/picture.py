"""`nacre btf picture`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from nacre.array import Floats
from nacre.cli.btf.options import pixels_option
from nacre.cli.console import check_outputs, console, file_path, print_table

if TYPE_CHECKING:
    from nacre.btf.image_folder import Quantity


_LIGHTS = ((0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (60.0, 90.0))
_VIEWS = ((0.0, 0.0), (30.0, 180.0), (60.0, 180.0))
_CELL = 256
"""Most pixels of an edge of a picture in a sheet."""


def _angles(
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


@click.command("picture")
@click.argument("source", type=file_path())
@click.option(
    "-o", "--output", required=True, type=file_path(), help="Picture to write (.png, .jpg, .exr)."
)
@click.option("--light", callback=_angles, metavar="THETA,PHI", help="To the light, in degrees.")
@click.option("--view", callback=_angles, metavar="THETA,PHI", help="To the viewer, in degrees.")
@pixels_option
def command(
    source: Path,
    output: Path,
    light: tuple[float, float] | None,
    view: tuple[float, float] | None,
    pixels: Quantity | None,
) -> None:
    """Show the texture at SOURCE at the measured pair of directions nearest to one given.

    Without a light or a view, a sheet with some: columns are lights, rows are views. Pictures show
    reflectance factors: 1 is white.
    """
    from nacre.btf.directions import from_degrees
    from nacre.btf.formats import load
    from nacre.btf.selection import nearest_pair
    from nacre.geometry import split, to_spherical
    from nacre.render.preview import check_image_path, write_image

    check_image_path(output)
    check_outputs([output], [source])
    btf = load(source, pixels)
    lights, views = [light] if light else _LIGHTS, [view] if view else _VIEWS
    pairs = [
        nearest_pair(btf, from_degrees(*wi), from_degrees(*wo)) for wo in views for wi in lights
    ]
    step = 1 if len(pairs) == 1 else math.ceil(max(btf.width, btf.height) / _CELL)
    shown, which = np.unique(pairs, return_inverse=True)
    cells = [_reduced(btf.images(np.array([pair]))[0], step) for pair in shown]
    rows = which.reshape(len(views), len(lights))
    sheet = np.concatenate([np.concatenate([cells[k] for k in row], axis=1) for row in rows])
    write_image(sheet, output)
    columns = ("pair", "light theta", "phi", "view theta", "phi")
    print_table(
        columns,
        (
            (str(pair), *(f"{np.degrees(a):.1f}" for w in (btf.wi, btf.wo)
                          for a in to_spherical(split(w[pair]))))
            for pair in pairs
        ),
    )  # fmt: skip
    console.print(f"{output}: {sheet.shape[1]} x {sheet.shape[0]} pixels", markup=False)


def _reduced(picture: Floats, step: int) -> Floats:
    """Means over squares of pixels; those that are left at the right and below are cut off."""
    height, width = (n // step * step for n in picture.shape[:2])
    if not height or not width:
        return picture
    squares = picture[:height, :width].reshape(height // step, step, width // step, step, 3)
    mean: Floats = squares.mean(axis=(1, 3))
    return mean
