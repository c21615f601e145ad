"""`nacre btf nearest`."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from nacre.cli.btf.kinds import expect
from nacre.cli.console import Stages, check_outputs, console, file_path, print_json, print_table
from nacre.errors import NacreError


@click.command("nearest")
@click.argument("codes", type=file_path())
@click.argument("x", type=click.IntRange(0))
@click.argument("y", type=click.IntRange(0))
@click.argument("among", nargs=-1, type=file_path())
@click.option("--count", default=5, type=click.IntRange(1, 1000), help="Texels to find.")
@click.option("--one-each", is_flag=True, help="Of each texture only the nearest texel.")
@click.option(
    "--picture", type=file_path(), help="Also write spheres of the texels (.png, .svg, .pdf)."
)
@click.option("--json", "as_json", is_flag=True, help="One object, as JSON.")
def command(
    codes: Path,
    x: int,
    y: int,
    among: tuple[Path, ...],
    count: int,
    one_each: bool,
    picture: Path | None,
    as_json: bool,
) -> None:
    """Find the texels that look most like the one in column X and row Y of CODES.

    They are sought in the encoded textures AMONG, or in CODES itself where none is given; all must
    be of one model. Columns and rows count from 0. A distance is the root of the mean squared
    difference of square roots of reflectance, over many pairs of directions.
    """
    from nacre.figures.plot import check_plot_path, write_plot
    from nacre.figures.texel_spheres import spheres_figure, texel_spheres
    from nacre.textures.embedding import nearest_texels
    from nacre.textures.latent_file import load_latent_maps

    paths = [codes, *(among or [codes])]
    for path in paths:
        expect(path, "an encoded texture")
    if picture is not None:
        check_plot_path(picture)
        check_outputs([picture], paths)
    texture, *textures = load_latent_maps(paths)
    height, width, _ = texture.codes.shape
    if x >= width or y >= height:
        raise NacreError(
            f"{codes}: has {width} x {height} texels, none in column {x}, row {y}; they count "
            "from 0"
        )
    code = texture.codes[y, x].astype(np.float32)
    same = [path.resolve() == codes.resolve() for path in paths[1:]]
    itself = (same.index(True), y * width + x) if any(same) else None
    with Stages() as stages:
        found = nearest_texels(
            code,
            textures,
            count,
            one_each=one_each,
            leave_out=itself,
            progress=stages.add(codes.stem),
        )
    rows, shown = [], [code]
    for neighbor in found:
        of = textures[neighbor.texture].codes
        row, column = divmod(neighbor.texel, of.shape[1])
        rows.append((str(paths[1 + neighbor.texture]), column, row, neighbor.distance))
        shown.append(of[row, column].astype(np.float32))
    if picture is not None:
        captions = [
            f"{codes.stem} ({x}, {y})",
            *(f"{Path(file).stem} ({i}, {j})\n{far:.3f}" for file, i, j, far in rows),
        ]
        spheres = texel_spheres(texture.codec, np.stack(shown))
        write_plot(spheres_figure(spheres, captions), picture)
    if as_json:
        nearest = [dict(zip(("file", "x", "y", "distance"), row, strict=True)) for row in rows]
        print_json({"file": str(codes), "x": x, "y": y, "nearest": nearest})
        return
    print_table(("texture", "x", "y", "distance"), rows)
    if picture is not None:
        console.print(f"{picture}: {len(shown)} spheres", markup=False)
