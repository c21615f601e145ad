"""Edits of textures by directions in the space of their codes: darker, duller, shinier.

Surfaces of the virtual capture are captured as they are and with one property of the surface
changed, on 16 x 16 texels from 31 x 31 directions. From texels before and after, regression on four
training recipes of each family learns what an edit does to a code, or to the coefficients that it
stands for. It is then applied to the recipes that are kept from training and compared with captures
of these that were really changed.

Run `python -m experiments.btf_editing OUT` from the root of the repository. OUT keeps the captures;
making them takes ten minutes of two cores.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.btf import TableBtf
from nacre.btf.capture import capture
from nacre.btf.capture.mesostructure import Mesostructure
from nacre.btf.capture.recipe import Recipe, built_in
from nacre.btf.domes import Dome
from nacre.btf.formats import load, save

DOME = Dome("coarse", ((0.0, 1, 0.0), (25.0, 6, 0.0), (50.0, 12, 0.0), (70.0, 12, 15.0)))
TEXELS, SAMPLES, CELLS = 16, 64, 128
RECIPES = 4
"""Of each family, for training."""

Edit = Callable[[Mesostructure], Mesostructure]


def _darker(surface: Mesostructure) -> Mesostructure:
    return dataclasses.replace(surface, albedo=0.6 * surface.albedo)


def _duller(surface: Mesostructure) -> Mesostructure:
    return dataclasses.replace(surface, roughness=np.minimum(1.6 * surface.roughness, 1.0))


def _shinier(surface: Mesostructure) -> Mesostructure:
    return dataclasses.replace(surface, specular=np.minimum(3.0 * surface.specular, 1.0))


EDITS: dict[str, Edit] = {
    "albedo x 0.6": _darker,
    "roughness x 1.6": _duller,
    "specular x 3": _shinier,
}


def recipes() -> list[Recipe]:
    """The first four of each family, and those that are kept from training."""
    return [r for r in built_in() if r.unseen or int(r.name[-2:]) <= RECIPES]


def captured(recipe: Recipe, edit: str, folder: Path) -> TableBtf:
    """A surface as it is where there is no edit, or edited; from the folder if it is there."""
    path = folder / f"{recipe.name} {edit}.npz".replace(" ", "-")
    if not path.exists():
        surface = recipe.build(CELLS)
        if edit:
            surface = EDITS[edit](surface)
        wi, wo = DOME.pairs()
        save(capture(surface, wi, wo, TEXELS, samples=SAMPLES, name=recipe.name), path)
    texture = load(path)
    assert isinstance(texture, TableBtf)
    return texture


def main() -> None:
    import sys

    f = Path(sys.argv[1])
    f.mkdir(exist_ok=True, parents=True)
    for r in recipes():
        for e in ("", *EDITS):
            captured(r, e, f)


if __name__ == "__main__":
    main()
