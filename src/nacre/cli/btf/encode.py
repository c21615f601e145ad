"""`nacre btf encode`."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import pixels_option
from nacre.cli.btf.written import source_of
from nacre.cli.console import Stages, check_outputs, console, counted, file_path, print_facts
from nacre.errors import FormatError, NacreError
from nacre.io.files import digest

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity
    from nacre.textures.latent_map import CodecFile


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
    from nacre.formats import load_btf
    from nacre.measured.textures.transposition import transposed
    from nacre.metrics.texture_errors import UNITS
    from nacre.textures.codecs.codec_file import load_codec
    from nacre.textures.latent_file import check_latent_path, save_latent_map
    from nacre.textures.latent_map import LatentMap
    from nacre.textures.pretrained import PUBLISHED
    from nacre.workflows.encoding import encode
    from nacre.workflows.identity import source_files, source_mark

    model = model or PUBLISHED
    check_latent_path(output)
    reference = None if embed else _reference(model, output)
    state = output.with_name(f"{output.name}.state")
    if state.exists() and not resume:
        raise NacreError(
            f"{state}: an encoding or a training was stopped here; add --resume to go on with the "
            "same command, or remove the file"
        )
    listed = [directions] if directions is not None else []
    check_outputs([output, state], [source, model, *listed])
    if not listed:
        expect(source, "a texture", "an encoded texture")
    elif not source.is_dir():
        raise FormatError(f"{source}: --directions is for a folder of images; leave it out")
    expect(model, "a model of textures")
    codec = load_codec(model)
    btf = load_btf(source, quantity=pixels, directions=directions)
    marks = [source_mark(source, btf), str(pixels), *map(digest, [model, *listed])]
    began = time.monotonic()
    with Stages() as stages:
        progress = stages.add(output.stem)
        with transposed(btf, output.parent, progress=progress) as texels:
            found = encode(
                texels,
                codec,
                half=half,
                texels_per_block=texels_per_block,
                state=state,
                mark=" ".join(marks),
                progress=progress,
            )
    seconds = time.monotonic() - began
    compared = {"pairs compared a texel": found.compared}
    errors = found.errors.facts() | compared
    facts: dict[str, Any] = {"source": source_of(source), "model": model.name, "errors": errors}
    latent = LatentMap(found.codes, codec, btf.wi, btf.wo, btf.name, reference, facts)
    save_latent_map(latent, output)
    state.unlink(missing_ok=True)
    before = sum(path.stat().st_size for path in source_files(source, btf))
    after = output.stat().st_size
    shown, by_view = found.errors.shown()
    rows = [
        ("texels", f"{btf.width} x {btf.height}, {counted(codec.values, 'value', 'values')} each"),
        *(shown | compared).items(),
        *((f"MSE x 1e4, views {name}", mse) for name, mse in by_view.items()),
        ("seconds", seconds),
        ("bytes of codes", found.codes.nbytes),
        ("bytes", after),
        ("bytes of the source", before),
        ("ratio", before / after),
    ]
    print_facts(output.name, rows, UNITS)
    if not embed and model != PUBLISHED:
        console.print(f"{output}: keep {model.name} beside it", markup=False)


def _reference(model: Path, output: Path) -> CodecFile:
    from nacre.textures.latent_map import CodecFile
    from nacre.textures.pretrained import PUBLISHED

    if model != PUBLISHED and model.resolve().parent != output.resolve().parent:
        raise FormatError(
            f"{model}: --reference names a model in the folder of {output}; copy it there, or embed"
        )
    return CodecFile(model.name, digest(model))
