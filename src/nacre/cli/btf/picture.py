from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import check_pixels, expect
from nacre.cli.options import option
from nacre.cli.report import print_table, progress, report

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


_LIGHTS = ((0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (60.0, 90.0))
_VIEWS = ((0.0, 0.0), (30.0, 180.0), (60.0, 180.0))


@make(
    "picture",
    options.argument("source", metavar="INPUT"),
    options.output_option("Picture to write (.png, .jpg, .exr)."),
    option("--wi", options.DIRECTION, help="Direction to the light, in degrees."),
    option("--wo", options.DIRECTION, help="Direction to the viewer, in degrees."),
    options.pixels_option(),
)
def command(
    source: Path,
    output: Path,
    wi: tuple[float, float] | None,
    wo: tuple[float, float] | None,
    pixels: Quantity | None,
) -> None:
    """Show a texture at the measured pair of directions nearest to the given one.

    Without --wi or --wo, draw a sheet, lights across and views down, each pair once, with captions
    except in .exr, which holds only values. Pictures show reflectance factors: 1 is white.
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
    from nacre.mitsuba.preview import check_image_path, write_bytes, write_image
    from nacre.workflows.identity import source_files

    expect(source, "a texture", "an encoded texture")
    check_pixels(source, pixels)
    check_image_path(output)
    progress(output.stem, "reading")
    btf = load_btf(source, quantity=pixels)
    options.check_outputs([output], [source, *source_files(source, btf)])
    lights, views = [wi] if wi else _LIGHTS, [wo] if wo else _VIEWS
    pairs = np.array(list(dict.fromkeys(nearest_pairs(btf, lights, views).flat)))
    across = min(len(lights), len(pairs))
    if (wi and wo) or output.suffix.lower() == ".exr":
        values = laid_out(in_rows(reduced_pictures(btf, pairs), across))
        write_image(values, output)
        height, width = values.shape[:2]
    else:
        panels = texture_panels(btf, pairs, across)
        write_bytes(panels, output)
        height, width = panels.shape[:2]
    angles = [
        [float(np.degrees(a)) for w in (btf.wi, btf.wo) for a in to_spherical(split(w[pair]))]
        for pair in pairs
    ]
    columns = ("pair", "light theta", "phi", "view theta", "phi")
    rows = list(zip(map(int, pairs), angles, strict=True))
    print_table(columns, ((str(pair), *(f"{a:.1f}" for a in row)) for pair, row in rows))
    shown = [{"pair": pair, "light_deg": row[:2], "view_deg": row[2:]} for pair, row in rows]
    data = {"output": str(output), "width": width, "height": height, "pairs": shown}
    report(f"{output}: {width} x {height} pixels", data)
