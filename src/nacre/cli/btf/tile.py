from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.btf.written import OUTPUT_HELP, check_codec, write
from nacre.cli.command import command as make
from nacre.cli.report import progress


@make(
    "tile",
    options.argument("source", metavar="INPUT"),
    options.output_option(OUTPUT_HELP),
    options.texels_option(default="1x1", help="Width and height of the texture in texels."),
    options.directions_option(default="bonn"),
    options.codec_option(),
    reads=True,
)
def command(
    source: Path, output: Path, texels: tuple[int, int], directions: str, codec: Path | None
) -> None:
    """Make a texture that has one reflectance everywhere."""
    from nacre.formats import load_brdf
    from nacre.measured.textures.direction_list import named_directions
    from nacre.textures.uniform import tile

    check_codec(output, codec)
    options.check_outputs([output], [source, codec])
    progress(output.stem, "evaluating")
    texture = tile(load_brdf(source), *named_directions(directions))
    write(texture, output, codec, texels)
