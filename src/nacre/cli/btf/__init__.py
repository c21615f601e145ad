"""`nacre btf`. Each command lives in a module of its own, loaded when it runs."""

from __future__ import annotations

import click

from nacre.cli.group import LazyGroup

_COMMANDS: dict[str, str] = {
    "average": "Make one material of a texture: the mean of its texels.",
    "blend": "Mix two encoded textures by a mask.",
    "capture": "Measure a made-up surface with a virtual gonioreflectometer.",
    "compare": "Errors of one texture against another.",
    "convert": "Write a texture in another format.",
    "decode": "Write the texture that was encoded.",
    "encode": "Make the texels of a texture into a few values each.",
    "info": "Show what is in a texture, or in a model of some.",
    "map": "Lay out texels of encoded textures, those that look alike together.",
    "mipmap": "Filter an encoded texture for views from afar.",
    "nearest": "Find the texels that look most like one.",
    "picture": "Show a texture under some lights from some views.",
    "plan": "List directions to photograph where few photographs can be taken.",
    "render": "Path trace a texture on a cylinder, a sphere or the ground.",
    "spread": "Make a texture of one material.",
    "synthesize": "Make an encoded texture larger, of patches of it.",
    "train": "Train a model that encodes textures.",
}


@click.group("btf", cls=LazyGroup, package=__name__, commands_help=_COMMANDS, no_args_is_help=False)
def command() -> None:
    """Textures of measured reflectance (BTFs)."""
