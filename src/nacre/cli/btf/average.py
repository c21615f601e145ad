from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nacre.cli import options
from nacre.cli.btf.written import OUTPUT_HELP, check_codec, write
from nacre.cli.command import command as make
from nacre.cli.kinds import check_pixels, expect
from nacre.cli.report import progress

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@make(
    "average",
    options.argument("source", metavar="INPUT"),
    options.output_option(OUTPUT_HELP),
    options.codec_option(),
    options.pixels_option(),
)
def command(source: Path, output: Path, codec: Path | None, pixels: Quantity | None) -> None:
    """Average the texels of a texture into one reflectance, as it looks from far away.

    All commands treat the resulting codes as a reflectance: nacre fit turns them into a network,
    nacre compare and nacre plot show them.
    """
    from nacre.formats import load_btf
    from nacre.textures.uniform import average

    check_codec(output, codec)
    options.check_outputs([output], [source, codec])
    expect(source, "a texture", "an encoded texture")
    check_pixels(source, pixels)
    line = progress(output.stem, "reading")
    mean = average(load_btf(source, quantity=pixels), line)
    write(mean, output, codec)
