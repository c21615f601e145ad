"""`nacre btf spread`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.btf.uniform import check_model, model_option, output_option, write
from nacre.cli.console import check_outputs, file_path


@click.command("spread")
@click.argument("source", type=file_path())
@output_option
@click.option(
    "--size",
    nargs=2,
    type=click.IntRange(1, 1 << 14),
    default=(1, 1),
    metavar="WIDTH HEIGHT",
    help="In texels.  [default: 1 1]",
)
@click.option(
    "--directions",
    default="bonn",
    metavar="bonn|utia|PATH",
    help="Pairs of directions: every light with every view of a dome, or a list (.csv).  "
    "[default: bonn]",
)
@model_option
def command(
    source: Path, output: Path, size: tuple[int, int], directions: str, model: Path | None
) -> None:
    """Make a texture that has the material at SOURCE, measured or neural, everywhere."""
    from nacre.formats import load_brdf
    from nacre.measured.textures.direction_list import named_directions
    from nacre.textures.uniform import tile

    check_model(output, model)
    check_outputs([output], [source, *([model] if model else [])])
    texture = tile(load_brdf(source), *named_directions(directions))
    write(texture, output, model, size)
