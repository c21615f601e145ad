from __future__ import annotations

from nacre.cli.command import Group

command = Group(
    "measure",
    package=__name__,
    commands_help={
        "Commands": {
            "plan": "Plan the directions to measure on a new material.",
            "next": "Propose the directions to measure next.",
            "bsdf": "Measure a Mitsuba BSDF virtually.",
        },
    },
    help="Plan a few measurements, or measure a Mitsuba BSDF virtually.\n\nA plan is a table with "
    "empty cells; filled in, it is a measurement that 'nacre fit' takes.",
)
