from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import kind_of
from nacre.cli.options import option
from nacre.cli.ranges import FiniteRange, IntRange
from nacre.cli.rendering import render_reflectance, render_scene, render_texture
from nacre.formats import describe_kind
from nacre.mitsuba import scene
from nacre.mitsuba.moving_light import PATHS
from nacre.mitsuba.preview import DENOISED_SPP, MAX_SIZE, PLAIN_SPP
from nacre.mitsuba.textures import scene as texture_scene
from nacre.mitsuba.textures.plugins import DECODERS
from nacre.mitsuba.textures.texels import INTERPOLATIONS
from nacre.workflows.texture_rendering import TEXTURE_SPP

_SHAPES = list(dict.fromkeys((*scene.SHAPES, *texture_scene.GEOMETRIES)))
_LIGHTS = list(dict.fromkeys((*scene.LIGHTS, *texture_scene.LIGHTS)))
_PIXELS = IntRange(1, MAX_SIZE)
_OF_SCENES = "scene"
_SCENE_OPTIONS = ("output", "size", "height", "spp", "seed", "denoise", "resume")


def _size(text: str) -> tuple[int, int | None]:
    """Width, and height if it is given."""
    parts = text.lower().split("x")
    if len(parts) > 2 or not all(p.isascii() and p.isdigit() and len(p) < 12 for p in parts):
        raise ValueError(f"{text!r}: expected a width, or a width and a height, like 640x480")
    sizes = [int(part) for part in parts]
    for size in sizes:
        if not 1 <= size <= MAX_SIZE:
            raise ValueError(f"expected 1 to {MAX_SIZE:,}, got {size:,}")
    return sizes[0], (sizes[1] if len(sizes) > 1 else None)


def _definition(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise ValueError(f"{text!r}: expected a name and a value, like width=640")
    return name, value


@make(
    "render",
    options.argument("source", metavar="INPUT"),
    options.output_option(required=False, shown="NAME.png; NAME.gif with --frames"),
    "Picture to write: .exr (linear), .png or .jpg; with --frames .gif, .png or .webp.",
    option(
        "--shape",
        _SHAPES,
        metavar="NAME",
        shown=f"{scene.SHAPES[0]}; {texture_scene.GEOMETRIES[0]} for textures",
    ),
    f"Object to show: {', '.join(scene.SHAPES)}; for textures "
    f"{', '.join(texture_scene.GEOMETRIES)}.",
    option("--light", _LIGHTS, metavar="NAME", default="environment"),
    f"Light on the object: {', '.join(_LIGHTS)}.",
    options.environment_option(),
    option("--size", options.Parsed("N|WxH", _size), default="512", shown="512; a scene's own"),
    f"Width of the picture, or width and height, in pixels. 1 to {MAX_SIZE:,}.",
    option("--height", _PIXELS, shown="the width; in a scene's proportions"),
    "Height of the picture in pixels; not for textures.",
    option(
        "--spp",
        IntRange(1),
        shown=f"{DENOISED_SPP}; {PLAIN_SPP} without --denoise; {TEXTURE_SPP} for textures; a "
        "scene's own",
    ),
    "Samples per pixel.",
    option("--denoise/--no-denoise", default=True),
    "Remove noise if Intel's denoiser is installed (extra: render); not from animations and "
    "comparisons, and from scenes if you say so.",
    options.seed_option(),
    option("--resume", is_flag=True),
    "Resume the same command where it stopped; what took less than a minute is not kept.",
    option("--angle", FiniteRange(0.0, 89.0), applies="btf", default=45.0),
    "Angle between the view and a directional or point light, in degrees.",
    option("--repeat", IntRange(1), applies="btf", default=4),
    "Repetitions of the texture around the object.",
    option("--mipmap", applies="btf", is_flag=True),
    "Filter an encoded texture for distant views, so that fewer samples suffice.",
    option(
        "--interpolation",
        INTERPOLATIONS,
        applies="btf",
        metavar="KIND",
        default=INTERPOLATIONS[0],
    ),
    "Interpolation between texels. stochastic: one of four at random. linear: all four. nearest: "
    "the nearest.",
    option("--decode decoder", DECODERS, applies="btf", default=DECODERS[0]),
    "Decode codes with a table of functions, or with the networks at every hit.",
    option("--reference", options.INPUT, applies="btf"),
    "Original texture to show on the left and compare with; errors are on the right, except in "
    ".exr.",
    option("--frames", IntRange(2, 10_000), applies="btf", group="animations of textures"),
    "Number of frames, over which a directional or point light moves.",
    option("--light-path", PATHS, applies="btf", group="animations of textures", shown=PATHS[0]),
    "Path of the light: around the normal at the center of the picture, or over the object from "
    "left to right.",
    options.height_field_option(group="parallax of textures"),
    "Gray image of heights, for a texture whose texels follow a surface: see nacre btf capture "
    "--height-map.",
    options.depth_option(group="parallax of textures"),
    option(
        "-D --define",
        options.Parsed("NAME=VALUE", _definition),
        applies=_OF_SCENES,
        multiple=True,
    ),
    "Value of a parameter that the scene calls $NAME, in place of its <default>; may be repeated.",
    option("--sensor", applies=_OF_SCENES, metavar="N|ID", shown="the first"),
    "Sensor to render, by its number from 0 or its id.",
    option("--variant", applies=_OF_SCENES, metavar="NAME", shown="llvm_ad_rgb"),
    "Variant of Mitsuba to render with, such as llvm_ad_spectral.",
    reads=True,
)
def command(source: Path, output: Path | None, **chosen: Any) -> None:
    """Render a preview of a material by path tracing, or a Mitsuba scene (.xml).

    A reflectance is shown on an object, a texture on a cylinder, a sphere, a plane or the ground;
    --frames animates the light. A scene may use nacre's plugins (nbrdf and others), which the
    mitsuba command does not know.
    """
    if source.suffix.lower() == ".xml" and not describe_kind(source):
        for given, flag in options.given():
            if given.applies != _OF_SCENES and given.name not in _SCENE_OPTIONS:
                raise click.UsageError(f"{flag} is for materials; {source} is a scene")
        render_scene(source, output, chosen)
        return
    options.refuse([_OF_SCENES], f"{source} is a material")
    for name in ("define", "sensor", "variant"):
        del chosen[name]
    if kind_of(source) == "brdf":
        render_reflectance(source, output, chosen)
    else:
        render_texture(source, output, chosen)
