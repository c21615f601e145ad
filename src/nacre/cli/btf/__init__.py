from __future__ import annotations

from nacre.cli.command import Group

command = Group(
    "btf",
    package=__name__,
    commands_help={
        "Get textures": {
            "capture": "Measure a made-up surface with a virtual gonioreflectometer.",
            "plan": "Choose the directions for a few photographs.",
            "tile": "Make a texture from one reflectance.",
        },
        "Encode textures": {
            "train": "Train a codec that encodes textures.",
            "recode": "Write an encoded texture in fewer bytes.",
            "decode": "Decode an encoded texture.",
        },
        "Change textures": {
            "synthesize": "Make a larger texture from patches of an encoded one.",
            "blend": "Blend two encoded textures with a mask.",
            "average": "Average a texture into one reflectance.",
        },
        "Look at textures": {
            "picture": "Show a texture under some lights from some views.",
            "mipmap": "Filter an encoded texture for distant views.",
            "nearest": "Find the texels that look most like a given one.",
            "map": "Draw a map of texels, similar ones close together.",
        },
    },
    help="Textures of measured reflectance (BTFs).\n\nTextures are materials: nacre info, compare, "
    "convert, render, fit and plot take them too, and nacre fit encodes them.",
)
