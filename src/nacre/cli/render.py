"""`nacre render`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.materials import kind_of
from nacre.cli.rendering import TEXTURE_SPP, render_reflectance, render_scene, render_texture
from nacre.render import scene
from nacre.render.preview import DENOISED_SPP, MAX_SIZE, PLAIN_SPP
from nacre.render.textures import scene as texture_scene
from nacre.render.textures.moving_light import PATHS
from nacre.render.textures.plugins import DECODERS
from nacre.render.textures.texels import INTERPOLATIONS

_SHAPES = list(dict.fromkeys((*scene.SHAPES, *texture_scene.GEOMETRIES)))
_LIGHTS = list(dict.fromkeys((*scene.LIGHTS, *texture_scene.LIGHTS)))
_PIXELS = click.IntRange(1, MAX_SIZE)
_SCENE_OPTIONS = ("source", "output", "spp", "seed")


@make("render", writes=True, reports=True)
@options.input_argument("source", metavar="INPUT")
@options.output_option(
    "Picture to write: .exr (linear), .png or .jpg; with --frames .gif, .png or .webp.",
    required=False,
    show_default="NAME.png, with --frames NAME.gif",
)
@options.option(
    "--shape",
    type=click.Choice(_SHAPES),
    show_default=f"{scene.SHAPES[0]}; {texture_scene.GEOMETRIES[0]} for textures",
    help="Object to show.",
)
@options.option(
    "--light", type=click.Choice(_LIGHTS), default="environment", help="Light on the object."
)
@options.environment_option()
@options.option("--size", type=_PIXELS, default=512, help="Width of the picture in pixels.")
@options.option(
    "--height",
    applies="brdf",
    type=_PIXELS,
    show_default="the width",
    help="Height of the picture in pixels.",
)
@options.option(
    "--spp",
    type=click.IntRange(1),
    show_default=f"{DENOISED_SPP}, not denoised {PLAIN_SPP}; {TEXTURE_SPP} for textures; as a "
    "scene says",
    help="Samples per pixel.",
)
@options.option(
    "--denoise/--no-denoise",
    applies="brdf",
    default=True,
    help="Remove noise, where Intel's denoiser is installed (extra: render).",
)
@options.seed_option()
@options.option(
    "--angle",
    applies="btf",
    type=click.FloatRange(0.0, 89.0),
    default=45.0,
    help="Degrees between the view and a directional or point light.",
)
@options.option(
    "--repeat",
    applies="btf",
    type=click.IntRange(1),
    default=4,
    help="Repetitions of the texture around the object.",
)
@options.option(
    "--frames",
    applies="btf",
    type=click.IntRange(2, 10_000),
    help="Frames of an animation in which a directional or point light moves.",
)
@options.option(
    "--light-path",
    applies="btf",
    type=click.Choice(PATHS),
    show_default=PATHS[0],
    help="Path of that light: around the normal in the middle of the picture, or from the left "
    "over the object to the right.",
)
@options.option(
    "--decode",
    "decoder",
    applies="btf",
    type=click.Choice(DECODERS),
    default=DECODERS[0],
    help="Decode codes from functions in a table, or by the networks at every hit.",
)
@options.option(
    "--interpolation",
    applies="btf",
    type=click.Choice(INTERPOLATIONS),
    default=INTERPOLATIONS[0],
    help="Interpolation between texels: one of four by chance, all four, or the nearest.",
)
@options.option(
    "--mipmap",
    applies="btf",
    is_flag=True,
    help="Filter an encoded texture by a pyramid for views from afar, which takes fewer samples.",
)
@options.option(
    "--height-field", applies="btf", type=options.INPUT, help="Gray image for parallax."
)
@options.option(
    "--depth",
    applies="btf",
    type=options.FiniteRange(0.0),
    default=0.1,
    help="Depth of the height field from black to white, in widths of the texture.",
)
@options.option(
    "--reference",
    applies="btf",
    type=options.INPUT,
    help="Texture that was encoded, to show at the left and to compare with; errors are shown at "
    "the right, but for .exr, which holds values only.",
)
def command(source: Path, output: Path | None, **chosen: Any) -> None:
    """Render a preview of a material by path tracing, or a Mitsuba scene (.xml).

    A reflectance is shown on an object, a texture on a cylinder, a sphere, a plane or the ground;
    with --frames, as an animation of a moving light. A scene may use nacre's plugins (nbrdf and
    the others), which the mitsuba command cannot know of.
    """
    if source.suffix.lower() == ".xml":
        for name in chosen:
            if options.is_given(name) and name not in _SCENE_OPTIONS:
                option = name.replace("_", "-")
                raise click.UsageError(f"--{option} is for materials; {source} is a scene")
        render_scene(source, output, chosen["spp"], chosen["seed"])
    elif kind_of(source) == "brdf":
        render_reflectance(source, output, chosen)
    else:
        render_texture(source, output, chosen)
