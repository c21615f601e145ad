"""`nacre render`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.console import Stages, check_outputs, console, environment_option, file_path
from nacre.cli.ranges import SEED
from nacre.render.preview import MAX_SIZE
from nacre.render.scene import LIGHTS, SHAPES

_SIZE = click.IntRange(1, MAX_SIZE)


@click.command("render")
@click.argument("file", type=file_path())
@click.option(
    "-o",
    "--output",
    type=file_path(),
    help="Picture to write: .exr (linear), .png or .jpg. Default: MATERIAL.png in this folder.",
)
@click.option("--shape", type=click.Choice(SHAPES), default="ball", help="Object shown.")
@click.option(
    "--light",
    type=click.Choice(LIGHTS),
    default="environment",
    help="Light that falls on it.",
)
@environment_option
@click.option("--size", type=_SIZE, default=512, help="Width of the picture in pixels.")
@click.option("--height", type=_SIZE, help="Height in pixels. Default: the width.")
@click.option("--spp", type=click.IntRange(1), default=256, help="Samples per pixel.")
@click.option("--seed", type=SEED, default=0, help="Of the samples.")
def command(
    file: Path,
    output: Path | None,
    shape: str,
    light: str,
    environment: Path | None,
    size: int,
    height: int | None,
    spp: int,
    seed: int,
) -> None:
    """Path trace a measured or neural material on an object."""
    from nacre.formats import load_brdf
    from nacre.render.environment import load_environment
    from nacre.render.preview import check_image_path, render_preview, write_image

    output = output or Path(f"{file.stem}.png")
    check_image_path(output)
    check_outputs([output], [file])
    brdf = load_brdf(file)
    lighting = load_environment(environment) if environment else None
    with Stages() as stages:
        report = stages.add(file.stem)
        report("compiling", 0, spp)
        image = render_preview(
            brdf,
            shape,
            light,
            (size, height or size),
            spp,
            seed,
            lighting,
            lambda part: report("rendering", round(part * spp), spp),
        )
    write_image(image, output)
    pixels = f"{size} x {height or size} pixels"
    console.print(f"{output}: {pixels}, {spp} samples per pixel", markup=False)
