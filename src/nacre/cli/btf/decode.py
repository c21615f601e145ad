from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nacre.cli import options
from nacre.cli.btf.written import report_texture
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.report import progress

if TYPE_CHECKING:
    from nacre.array import Floats


@make(
    "decode",
    options.argument("source", metavar="CODES"),
    options.output_option("Texture to write; its ending chooses the format."),
    options.directions_option(shown="those of the original texture"),
    "Directions: all pairs of a dome, those of another texture, or a list (.csv).",
)
def command(source: Path, output: Path, directions: str | None) -> None:
    """Decode an encoded texture at its own directions or at others."""
    from nacre.formats import save, target
    from nacre.textures.latent_file import load_latent_map
    from nacre.textures.latent_map import NeuralBtf

    target(output, "btf")
    options.check_outputs([output], [source, Path(directions) if directions else None])
    expect(source, "an encoded texture")
    line = progress(output.stem, "reading")
    btf = NeuralBtf(load_latent_map(source))
    if directions is not None:
        btf = btf.at_directions(*_pairs(directions))
    report_texture(output, btf, save(btf, output, progress=line))


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
