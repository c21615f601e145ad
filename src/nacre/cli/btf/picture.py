"""`nacre btf picture`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import angles, pixels_option
from nacre.cli.console import check_outputs, console, file_path, print_table

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


_LIGHTS = ((0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (60.0, 90.0))
_VIEWS = ((0.0, 0.0), (30.0, 180.0), (60.0, 180.0))


@click.command("picture")
@click.argument("source", type=file_path())
@click.option(
    "-o", "--output", required=True, type=file_path(), help="Picture to write (.png, .jpg, .exr)."
)
@click.option("--light", callback=angles, metavar="THETA,PHI", help="To the light, in degrees.")
@click.option("--view", callback=angles, metavar="THETA,PHI", help="To the viewer, in degrees.")
@pixels_option
def command(
    source: Path,
    output: Path,
    light: tuple[float, float] | None,
    view: tuple[float, float] | None,
    pixels: Quantity | None,
) -> None:
    """Show the texture at SOURCE at the measured pair of directions nearest to one given.

    Without a light or a view, a sheet with some, lights across and views down, each pair once. Its
    pictures have captions, but for .exr, which holds values only. Pictures show reflectance
    factors: 1 is white.
    """
    from nacre.figures.texture_views import (
        in_rows,
        laid_out,
        nearest_pairs,
        reduced_pictures,
        texture_panels,
    )
    from nacre.formats import load_btf
    from nacre.geometry import split, to_spherical
    from nacre.render.preview import check_image_path, write_bytes, write_image
    from nacre.workflows.identity import source_files

    expect(source, "a texture", "an encoded texture")
    check_image_path(output)
    btf = load_btf(source, quantity=pixels)
    check_outputs([output], [source, *source_files(source, btf)])
    lights, views = [light] if light else _LIGHTS, [view] if view else _VIEWS
    pairs = np.array(list(dict.fromkeys(nearest_pairs(btf, lights, views).flat)))
    across = min(len(lights), len(pairs))
    if (light and view) or output.suffix.lower() == ".exr":
        values = laid_out(in_rows(reduced_pictures(btf, pairs), across))
        write_image(values, output)
        height, width = values.shape[:2]
    else:
        panels = texture_panels(btf, pairs, across)
        write_bytes(panels, output)
        height, width = panels.shape[:2]
    columns = ("pair", "light theta", "phi", "view theta", "phi")
    print_table(
        columns,
        (
            (str(pair), *(f"{np.degrees(a):.1f}" for w in (btf.wi, btf.wo)
                          for a in to_spherical(split(w[pair]))))
            for pair in pairs
        ),
    )  # fmt: skip
    console.print(f"{output}: {width} x {height} pixels", markup=False)
