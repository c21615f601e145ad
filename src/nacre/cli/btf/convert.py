"""`nacre btf convert`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import pixels_option
from nacre.cli.btf.written import print_written
from nacre.cli.console import Stages, check_outputs, file_path

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@click.command("convert")
@click.argument("source", type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="File to write.")
@click.option(
    "--precision",
    type=click.Choice(["half", "single"]),
    help="Of the values of an .npz. Default: single of a table of such, else half.",
)
@click.option(
    "--components",
    type=click.IntRange(1),
    metavar="K",
    help="Of each channel of a factored file (.btf).",
)
@pixels_option
def command(
    source: Path,
    output: Path,
    precision: str | None,
    components: int | None,
    pixels: Quantity | None,
) -> None:
    """Write the texture at SOURCE to a file, in the format that its name ends in.

    SOURCE is a file, a folder of images, or a list of photographs (.csv). Images are read once;
    they take room on the disk twice while the file is written.
    """
    from nacre.formats import load_btf, save, target

    target(output, "btf")
    check_outputs([output], [source])
    expect(source, "a texture", "an encoded texture")
    btf = load_btf(source, quantity=pixels)
    given: dict[str, Any] = {"precision": precision, "components": components}
    options = {name: value for name, value in given.items() if value is not None}
    with Stages() as stages:
        loss = save(btf, output, progress=stages.add(output.stem), **options)
    print_written(output, btf, loss)
