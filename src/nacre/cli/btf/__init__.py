"""`nacre btf`. Each command lives in a module of its own, loaded when it runs."""

from __future__ import annotations

from nacre.cli.command import Group

command = Group(
    "btf",
    package=__name__,
    commands_help={
        "average": "Make one reflectance of a texture: the mean of its texels.",
        "blend": "Mix two encoded textures by a mask.",
        "capture": "Measure a made-up surface with a virtual gonioreflectometer.",
        "decode": "Write the texture that codes stand for.",
        "map": "Lay out texels of encoded textures in a map, similar ones together.",
        "mipmap": "Filter an encoded texture for views from afar.",
        "nearest": "Find the texels that look most like a given one.",
        "picture": "Show a texture under some lights from some views.",
        "plan": "Choose directions to photograph where few photographs can be taken.",
        "synthesize": "Make an encoded texture larger, from patches of it.",
        "tile": "Make a texture of one reflectance.",
        "train": "Train a codec that encodes textures.",
    },
    help="Textures of measured reflectance (BTFs).\n\nTextures are materials: nacre info, compare, "
    "convert, render, fit and plot take them too; nacre fit encodes one.",
)
