"""`nacre btf convert`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli.btf.options import pixels_option
from nacre.cli.console import Stages, check_outputs, console, file_path

if TYPE_CHECKING:
    from nacre.btf.image_folder import Quantity


@click.command("convert")
@click.argument("source", type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="File to write (.npz).")
@click.option(
    "--precision",
    type=click.Choice(["half", "single", "double"]),
    help="Of the values of an .npz. Default: as they are, and half of a folder of images.",
)
@pixels_option
def command(source: Path, output: Path, precision: str | None, pixels: Quantity | None) -> None:
    """Write the texture at SOURCE to a file, in the format that its name ends in.

    SOURCE is a file, a folder of images, or a list of photographs (.csv). Images are read once;
    they take room on the disk twice while the file is written.
    """
    from nacre.btf.formats import load, save, target

    target(output)
    check_outputs([output], [source])
    btf = load(source, pixels)
    options: dict[str, Any] = {} if precision is None else {"precision": precision}
    with Stages() as stages:
        save(btf, output, progress=stages.add(output.stem), **options)
    size = output.stat().st_size
    console.print(
        f"{output}: {btf.width} x {btf.height} texels, {btf.pair_count:,} pairs, {size:,} bytes",
        markup=False,
    )
