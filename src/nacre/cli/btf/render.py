"""`nacre btf render`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from nacre.cli.console import Stages, check_outputs, console, environment_option, file_path
from nacre.render.btf.plugins import DECODERS
from nacre.render.btf.scene import GEOMETRIES, LIGHTS
from nacre.render.btf.texels import INTERPOLATIONS
from nacre.render.preview import MAX_SIZE

if TYPE_CHECKING:
    from nacre.render.preview import Image


@click.command("render")
@click.argument("source", type=file_path())
@click.option(
    "-o",
    "--output",
    type=file_path(),
    help="Picture to write: .exr (linear), .png or .jpg. Default: NAME.png in this folder.",
)
@click.option("--geometry", type=click.Choice(GEOMETRIES), default="cylinder", help="Object shown.")
@click.option("--light", type=click.Choice(LIGHTS), default="environment", help="Light on it.")
@click.option(
    "--angle",
    type=click.FloatRange(0.0, 89.0),
    default=45.0,
    help="Degrees between the view and a directional or point light.",
)
@environment_option
@click.option("--repeat", type=click.IntRange(1), default=4, help="Times that it goes around.")
@click.option("--size", type=click.IntRange(1, MAX_SIZE), default=512, help="Edge in pixels.")
@click.option("--spp", type=click.IntRange(1), default=64, help="Samples per pixel.")
@click.option("--seed", type=click.IntRange(0), default=0, help="Of the samples.")
@click.option(
    "--decoder",
    type=click.Choice(DECODERS),
    default=DECODERS[0],
    help="Of an encoded texture: functions in a table, or the networks at every hit.",
)
@click.option(
    "--interpolation",
    type=click.Choice(INTERPOLATIONS),
    default=INTERPOLATIONS[0],
    help="Between texels: one of four by chance, all four, or the nearest.",
)
@click.option(
    "--filter",
    "filtered",
    is_flag=True,
    help="Show what pixels see of an encoded texture from afar with fewer samples, by a pyramid.",
)
@click.option("--height-field", type=file_path(), help="Grey image for parallax.")
@click.option(
    "--depth",
    type=click.FloatRange(0.0),
    default=0.1,
    help="Of the height field from black to white, in widths of the texture.",
)
@click.option(
    "--reference",
    type=file_path(),
    help="The texture that was encoded, interpolated, to show at the right and to compare with.",
)
def command(
    source: Path,
    output: Path | None,
    geometry: str,
    light: str,
    angle: float,
    environment: Path | None,
    repeat: int,
    size: int,
    spp: int,
    seed: int,
    decoder: str,
    interpolation: str,
    filtered: bool,
    height_field: Path | None,
    depth: float,
    reference: Path | None,
) -> None:
    """Path trace a texture, encoded or not, on a cylinder, a sphere, a plane or the ground."""
    from nacre.btf.formats import load
    from nacre.btf.latent_map import NeuralBtf
    from nacre.render.btf.plugins import texture_bsdf
    from nacre.render.btf.scene import describe_texture_scene, pixel_angle, texture_scale
    from nacre.render.environment import load_environment
    from nacre.render.preview import check_image_path, render_scene, write_image

    output = output or Path(f"{source.stem}.png")
    inputs = [path for path in (source, reference, height_field) if path is not None]
    check_image_path(output)
    check_outputs([output], inputs)
    lighting = load_environment(environment) if environment else None
    options: dict[str, Any] = {"interpolation": interpolation}
    own = {"decoder": decoder} | ({"pixel_angle": pixel_angle((size, size))} if filtered else {})
    if height_field is not None:
        options |= {"height_field": str(height_field), "depth": depth}

    def picture(path: Path, stages: Stages) -> Image:
        btf = load(path)
        neural = isinstance(btf, NeuralBtf)
        report = stages.add(path.stem)
        bsdf = texture_bsdf(
            btf.latent if isinstance(btf, NeuralBtf) else btf,
            report,
            **options,
            **(own if neural else {}),
            to_uv=texture_scale(geometry, repeat, btf.width / btf.height),
        )
        report("rendering", 0, spp)
        scene = describe_texture_scene(bsdf, geometry, light, (size, size), angle, lighting)
        return render_scene(
            scene, spp, seed, lambda part: report("rendering", round(part * spp), spp)
        )

    with Stages() as stages:
        image = picture(source, stages)
        if reference is not None:
            expected = picture(reference, stages)
            error = float(np.square(np.clip(image, 0, 1) - np.clip(expected, 0, 1)).mean())
            image = np.concatenate([image, expected], axis=1)
    write_image(image, output)
    facts = f"{image.shape[1]} x {image.shape[0]} pixels, {spp} samples per pixel"
    if reference is not None:
        facts += f", MSE x 1e4 of the picture {1e4 * error:.3g}, noise included"
    console.print(f"{output}: {facts}", markup=False)
