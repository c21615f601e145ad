"""`nacre btf decode`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.written import print_written
from nacre.cli.console import Stages, check_outputs, file_path

if TYPE_CHECKING:
    from nacre.array import Floats


@click.command("decode")
@click.argument("source", type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="File to write.")
@click.option(
    "--directions",
    metavar="bonn|utia|PATH",
    help="Pairs of directions: every light with every view of a dome; those of another texture; or "
    "a list (.csv) as nacre btf capture takes. Default: those of the texture that was encoded.",
)
def command(source: Path, output: Path, directions: str | None) -> None:
    """Write the texture that was encoded in SOURCE to a file, in the format of its name."""
    from nacre.formats import save, target
    from nacre.textures.latent_file import load_latent_map
    from nacre.textures.latent_map import NeuralBtf

    target(output, "btf")
    check_outputs([output], [source, *([] if directions is None else [Path(directions)])])
    expect(source, "an encoded texture")
    btf = NeuralBtf(load_latent_map(source))
    if directions is not None:
        btf = btf.at_directions(*_pairs(directions))
    with Stages() as stages:
        loss = save(btf, output, progress=stages.add(output.stem))
    print_written(output, btf, loss)


def _pairs(directions: str) -> tuple[Floats, Floats]:
    from nacre.formats import load_btf
    from nacre.measured.textures.direction_list import DOMES, named_directions

    path = Path(directions)
    listed = path.suffix.lower() == ".csv" or not path.exists()
    if directions.lower() in DOMES or listed:
        return named_directions(directions)
    expect(path, "a texture", "an encoded texture")
    btf = load_btf(path)
    return btf.wi, btf.wo
