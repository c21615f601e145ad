"""`nacre latent`. Each command lives in a module of its own, loaded when it runs."""

from __future__ import annotations

from nacre.cli.command import Group

command = Group(
    "latent",
    package=__name__,
    commands_help={
        "decode": "Write the material that a code stands for.",
        "encode": "Find the code of a material.",
        "interpolate": "Render what lies between two materials or codes.",
        "map": "Lay out materials or codes in a map, neighbors side by side.",
        "project": "Bring a material back to what is plausible.",
        "sample": "Draw plausible materials that nobody measured.",
        "train": "Train a basis on materials.",
    },
    help="Encode materials as short codes in a basis that they share.\n\nA basis is functions "
    "that a small network gives, principal components on a grid, or a network that gives the "
    "weights of others. Pretrained ones are included.",
)
