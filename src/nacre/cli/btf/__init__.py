from __future__ import annotations

from nacre.cli.command import Group

command = Group(
    "btf",
    package=__name__,
    commands_help={
        "average": "Average a texture into one reflectance.",
        "blend": "Blend two encoded textures with a mask.",
        "capture": "Measure a made-up surface with a virtual gonioreflectometer.",
        "decode": "Decode an encoded texture.",
        "map": "Draw a map of texels, similar ones close together.",
        "mipmap": "Filter an encoded texture for distant views.",
        "nearest": "Find the texels that look most like a given one.",
        "picture": "Show a texture under some lights from some views.",
        "plan": "Choose the directions for a few photographs.",
        "synthesize": "Make a larger texture from patches of an encoded one.",
        "tile": "Make a texture from one reflectance.",
        "train": "Train a codec that encodes textures.",
    },
    help="Textures of measured reflectance (BTFs).\n\nTextures are materials: nacre info, compare, "
    "convert, render, fit and plot take them too, and nacre fit encodes them.",
)
