"""`nacre btf encode`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import pixels_option
from nacre.cli.console import Stages, console, counted, file_path, print_facts

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@click.command("encode")
@click.argument("source", type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="File (.safetensors).")
@click.option(
    "--directions",
    type=file_path(),
    help="List of directions (.csv) of the images in the folder SOURCE, where it lies elsewhere or "
    "is not called directions.csv.",
)
@click.option(
    "--model",
    type=file_path(),
    help="What encodes it; see nacre btf train. Default: the one that comes with nacre.",
)
@click.option(
    "--embed/--reference",
    default=True,
    help="Whether the model is written into the file, or named in it: it must then stay beside it, "
    "unless it came with nacre. Default: embed.",
)
@click.option("--half", is_flag=True, help="Write codes in half precision.")
@click.option(
    "--texels-per-block",
    type=click.IntRange(1),
    help="Texels in memory at a time.  [default: 256 MB of values]",
)
@click.option("--resume", is_flag=True, help="Go on where the same command was stopped.")
@pixels_option
def command(
    source: Path,
    output: Path,
    directions: Path | None,
    model: Path | None,
    embed: bool,
    half: bool,
    texels_per_block: int | None,
    resume: bool,
    pixels: Quantity | None,
) -> None:
    """Make the texels of the texture at SOURCE into a few values each, and tell the error.

    SOURCE is a file, a folder of images, or a list of photographs (.csv). What is written is a
    texture to all commands: it is decoded at the directions of SOURCE as it is used, or by nacre
    btf decode at any others. Until all is done, a state beside the output keeps the codes: after
    Ctrl-C nothing is lost, and a minute at most when it is killed. Images are read first, into a
    temporary file; that much is done again.
    """
    from nacre.metrics.texture_errors import UNITS
    from nacre.workflows.encoding import encode_texture

    if directions is None:
        expect(source, "a texture", "an encoded texture")
    if model is not None:
        expect(model, "a model of textures")
    with Stages() as stages:
        found = encode_texture(
            source,
            output,
            model=model,
            directions=directions,
            pixels=pixels,
            reference=not embed,
            half=half,
            texels_per_block=texels_per_block,
            resume=resume,
            progress=stages.add(output.stem),
        )
    height, width, code_dim = found.latent.codes.shape
    shown, by_view = found.errors.shown()
    rows = [
        ("texels", f"{width} x {height}, {counted(code_dim, 'value', 'values')} each"),
        *(shown | {"pairs compared a texel": found.compared}).items(),
        *((f"MSE x 1e4, views {name}", mse) for name, mse in by_view.items()),
        ("seconds", found.seconds),
        ("bytes of codes", found.latent.codes.nbytes),
        ("bytes", found.nbytes),
        ("bytes of the source", found.source_nbytes),
        ("ratio", found.source_nbytes / found.nbytes),
    ]
    print_facts(output.name, rows, UNITS)
    if found.beside is not None:
        console.print(f"{output}: keep {found.beside.name} beside it", markup=False)
