"""The materials that fits are timed on."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from nacre import Brdf, load
from nacre.measured.merl import tabulate
from tests.data import list_data, require_data

TABULATED = (
    "chrome",
    "gold-metallic-paint",
    "pink-fabric",
    "blue-acrylic",
    "black-phenolic",
    "blue-rubber",
    "cherry-235",
    "pink-felt",
)
"""Published networks of MERL materials that stand in for the tables they were fitted to."""


def materials() -> Iterator[tuple[str, Brdf]]:
    """Name and reflectance of the real RGL tables, and of published networks as MERL tables."""
    names = list_data("rgl", "*.bsdf")
    if not names:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    for name in names:
        yield name.removesuffix(".bsdf").removesuffix("_rgb"), load(require_data("rgl", name))
    for name in TABULATED:
        network = load(require_data("pretrained", "merl", f"{name}.h5"))
        yield name, tabulate(network)
