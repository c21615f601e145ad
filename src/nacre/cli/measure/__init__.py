from __future__ import annotations

from nacre.cli.command import Group

command = Group(
    "measure",
    package=__name__,
    commands_help={
        "Instruments": {
            "gloss": "Read the gloss of a material at 20, 60 and 85 degrees.",
            "haze": "Read the reflection haze of a material.",
            "multiangle": "Read the color of a material at several angles.",
            "sphere": "Read the color of a material in an integrating sphere.",
            "45-0": "Read the color of a material at 45:0.",
        },
        "Measurements": {
            "plan": "Plan the directions to measure on a new material.",
            "next": "Propose the directions to measure next.",
            "bsdf": "Measure a Mitsuba BSDF virtually.",
        },
    },
    modules={"45-0": "forty_five"},
    help="Read gloss, haze and color, or plan measurements.\n\nInstruments take "
    "any reflectance. A plan is a table with empty cells; filled in, it is a measurement that "
    "'nacre fit' takes.",
)
