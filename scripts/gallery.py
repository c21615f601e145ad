"""Lay out the library that `make gallery` shows: included reflectances, each with its OpenPBR form.

`python scripts/gallery.py` copies the networks that come with nacre into `out/gallery/library`, and
those OpenPBR forms that there are in `gallery/openpbr`. With `--openpbr` the others are fitted,
which takes minutes; what is there is kept: after a stop the same command goes on.
"""

from __future__ import annotations

import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import nacre
from nacre.analytic import MODELS, fit
from nacre.formats import load_brdf

ROOT = Path(__file__).resolve().parents[1]
LIBRARY, FORMS = ROOT / "out/gallery/library", ROOT / "gallery/openpbr"
OURS = "rgl"
"""Family whose forms are in FORMS, fitted to the tables as its networks are."""


def laid_out(name: str, fitting: bool) -> str:
    """Copy the network of a name and its OpenPBR form, which is fitted if asked for; the name."""
    (material,) = (m for m in nacre.materials(name) if m.name == name)
    folder = LIBRARY / material.family.name
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(material.path, folder)
    form = folder / f"{material.path.stem}.json"
    if material.family.name == OURS:
        shutil.copy(FORMS / form.name, form)
    elif fitting and not form.exists():
        nacre.save(fit(load_brdf(name), MODELS["openpbr"]), form)
    return name


def main(fitting: bool) -> None:
    """Lay out all of them, one a core."""
    names = [material.name for material in nacre.materials() if material.kind == "brdf"]
    with ProcessPoolExecutor() as pool:
        for name in pool.map(laid_out, names, [fitting] * len(names)):
            print(name, flush=True)


if __name__ == "__main__":
    if sys.argv[1:] not in ([], ["--openpbr"]):
        raise SystemExit(__doc__)
    main(len(sys.argv) > 1)
