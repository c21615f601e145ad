"""`nacre btf average`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import pixels_option
from nacre.cli.btf.uniform import check_model, model_option, output_option, write
from nacre.cli.console import Stages, check_outputs, file_path

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@click.command("average")
@click.argument("source", type=file_path())
@output_option
@model_option
@pixels_option
def command(source: Path, output: Path, model: Path | None, pixels: Quantity | None) -> None:
    """Make one material of the texture at SOURCE: the mean of its texels, as it looks from afar.

    Written as codes, it is a material to all of nacre's commands, as any measured one: nacre fit
    makes a network of it, nacre compare and nacre plot show it.
    """
    from nacre.formats import load_btf
    from nacre.textures.uniform import average

    check_model(output, model)
    check_outputs([output], [source, *([model] if model else [])])
    expect(source, "a texture", "an encoded texture")
    texture = load_btf(source, quantity=pixels)
    with Stages() as stages:
        mean = average(texture, stages.add(output.stem))
    write(mean, output, model)
