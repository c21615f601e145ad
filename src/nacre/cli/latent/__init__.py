from __future__ import annotations

from nacre.cli.command import Group

command = Group(
    "latent",
    package=__name__,
    commands_help={
        "Codes": {
            "encode": "Find the code of a material.",
            "decode": "Decode a code into a material.",
            "project": "Move a material to the nearest plausible one.",
            "sample": "Draw plausible materials that nobody measured.",
        },
        "Pictures": {
            "interpolate": "Render what lies between two materials or codes.",
            "map": "Draw a map of materials or codes, similar ones close together.",
        },
        "Bases": {"train": "Train a basis on materials."},
    },
    help="Encode materials as short codes in a shared basis.\n\nA basis is a small network whose "
    "outputs are functions of the directions, principal components on a grid, or a network that "
    "computes the weights of others. Pretrained ones are included.",
)
