"""`nacre btf render`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from nacre.cli.console import (
    Stages,
    check_outputs,
    console,
    environment_option,
    file_path,
    print_facts,
)
from nacre.render.preview import MAX_SIZE
from nacre.render.textures.moving_light import PATHS
from nacre.render.textures.plugins import DECODERS
from nacre.render.textures.scene import GEOMETRIES, LIGHTS
from nacre.render.textures.texels import INTERPOLATIONS

if TYPE_CHECKING:
    from nacre.array import Floats
    from nacre.figures.page import Bytes
    from nacre.metrics.temporal import TemporalErrors


@click.command("render")
@click.argument("source", type=file_path())
@click.option(
    "-o",
    "--output",
    type=file_path(),
    help="Picture to write: .exr (linear), .png or .jpg; of --frames .gif, .png or .webp. "
    "Default: NAME.png, or NAME.gif, in this folder.",
)
@click.option("--geometry", type=click.Choice(GEOMETRIES), default="cylinder", help="Object shown.")
@click.option("--light", type=click.Choice(LIGHTS), default="environment", help="Light on it.")
@click.option(
    "--angle",
    type=click.FloatRange(0.0, 89.0),
    default=45.0,
    help="Degrees between the view and a directional or point light.",
)
@click.option(
    "--frames",
    type=click.IntRange(2, 10_000),
    help="Pictures of an animation, whose directional or point light moves.",
)
@click.option(
    "--path",
    "way",
    type=click.Choice(PATHS),
    help="Of that light: a turn about the normal in the middle of the picture, or from the left "
    "over the object to the right. Default: around.",
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
@click.option("--height-field", type=file_path(), help="Gray image for parallax.")
@click.option(
    "--depth",
    type=click.FloatRange(0.0),
    default=0.1,
    help="Of the height field from black to white, in widths of the texture.",
)
@click.option(
    "--reference",
    type=file_path(),
    help="The texture that was encoded, interpolated, to show at the left and to compare with; "
    "errors are shown at the right, but for .exr, which holds values only.",
)
def command(
    source: Path,
    output: Path | None,
    geometry: str,
    light: str,
    angle: float,
    frames: int | None,
    way: str | None,
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
    """Path trace a texture, encoded or not, on a cylinder, a sphere, a plane or the ground.

    With --frames, an animation of a light that moves.
    """
    from nacre.color import tone_map
    from nacre.figures.page import display_bytes
    from nacre.figures.rendering_panels import panels_size, rendering_panels
    from nacre.formats import load_btf
    from nacre.metrics.temporal import temporal_errors
    from nacre.render.animation import check_animation, write_animation
    from nacre.render.environment import load_environment
    from nacre.render.preview import check_image_path, render_scene, write_bytes, write_image
    from nacre.render.textures.moving_light import light_path, render_moving
    from nacre.render.textures.plugins import texture_bsdf
    from nacre.render.textures.scene import describe_texture_scene, pixel_angle, texture_scale

    output = output or Path(f"{source.stem}.{'gif' if frames else 'png'}")
    inputs = [path for path in (source, reference, height_field) if path is not None]
    if frames is None:
        if way is not None:
            raise click.UsageError("--path: is of an animation; add --frames")
        check_image_path(output)
    else:
        if light == "environment":
            raise click.UsageError("--frames: add --light directional or point, which can move")
        check_animation(output, frames, *(panels_size(size) if reference else (size, size)))
    check_outputs([output], inputs)
    lighting = load_environment(environment) if environment else None
    options: dict[str, Any] = {"interpolation": interpolation}
    own = {"decoder": decoder} | ({"pixel_angle": pixel_angle((size, size))} if filtered else {})
    if height_field is not None:
        options |= {"height_field": str(height_field), "depth": depth}
    way = way or PATHS[0]

    def pictures(path: Path, stages: Stages) -> Iterator[Floats]:
        btf = load_btf(path)
        report = stages.add(path.stem)
        bsdf = texture_bsdf(
            btf.latent or btf,
            report,
            **options,
            **(own if btf.latent else {}),
            to_uv=texture_scale(geometry, repeat, btf.width / btf.height),
        )
        total = frames or spp
        report("rendering", 0, total)

        def progress(part: float) -> None:
            report("rendering", round(part * total), total)

        standing = frames is None or way != "around"
        scene = describe_texture_scene(
            bsdf, geometry, light, (size, size), angle, lighting, standing=standing
        )
        if frames is None:
            yield render_scene(scene, spp, seed, progress)
            return
        directions = light_path(way, frames, angle, geometry)
        for picture in render_moving(scene, directions, spp, seed, progress):
            yield np.clip(picture, 0.0, 1.0).astype(np.float16)  # finer than what is shown

    with Stages() as stages:
        shown = list(pictures(source, stages))
        expected = [] if reference is None else list(pictures(reference, stages))
    facts = f"{spp} samples per pixel"
    width, height = size, size
    pages: Iterable[Bytes] = (display_bytes(tone_map(picture)) for picture in shown)
    if reference is not None:
        errors = temporal_errors(zip(expected, shown, strict=True))
        facts += f", MSE x 1e4 {1e4 * errors.mse:.3g}, noise included"
        width, height = panels_size(size)
        pages = rendering_panels(expected, shown, (reference.name, source.name), facts)
    if output.suffix.lower() == ".exr":
        values = np.concatenate([*expected, *shown], axis=1)
        height, width = values.shape[:2]
        write_image(values, output)
    elif frames is None:
        (page,) = pages
        write_bytes(page, output)
    else:
        write_animation(pages, output)
    many = f"{frames} frames of " if frames else ""
    console.print(f"{output}: {many}{width} x {height} pixels, {facts}", markup=False)
    if frames is not None and reference is not None:
        print_facts("from frame to frame", _temporal(errors))


def _temporal(errors: TemporalErrors) -> list[tuple[str, float]]:
    return [
        ("variance of the error x 1e4", 1e4 * errors.variance),
        ("squared steps of the error x 1e4", 1e4 * errors.error_steps),
        ("squared steps of the reference x 1e4", 1e4 * errors.truth_steps),
        ("squared steps of the rendering x 1e4", 1e4 * errors.other_steps),
    ]
