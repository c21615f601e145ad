"""Lay out the library that `make gallery` shows: included reflectances, each with its OpenPBR form.

`python scripts/gallery.py` copies the networks that come with nacre into `out/gallery/library`, and
those OpenPBR forms that there are in `gallery/openpbr`. With `--openpbr` the others are fitted,
which takes minutes; what is there is kept: after a stop the same command goes on. Files
appear whole or not at all.
"""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import nacre
from nacre.analytic import MODELS, fit
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.io.files import atomic_path
from nacre.runtime.interrupts import Terminated, terminable
from nacre.runtime.parallel import core_count

ROOT = Path(__file__).resolve().parents[1]
LIBRARY, FORMS = ROOT / "out/gallery/library", ROOT / "gallery/openpbr"
OURS = "rgl"
"""Family whose forms are in FORMS, fitted to the tables as its networks are."""


def laid_out(name: str, fitting: bool) -> str:
    """Copy the network of a name and its OpenPBR form, which is fitted if asked for; the name."""
    (material,) = (m for m in nacre.materials(name) if m.name == name)
    folder = LIBRARY / material.family.name
    folder.mkdir(parents=True, exist_ok=True)
    copied(material.path, folder / material.path.name)
    form = folder / f"{material.path.stem}.json"
    if material.family.name == OURS:
        copied(FORMS / form.name, form)
    elif fitting and not form.exists():
        nacre.save(fit(load_brdf(name), MODELS["openpbr"]), form)
    return name


def copied(source: Path, path: Path) -> None:
    """Copy a file, whole or not at all."""
    with atomic_path(path, internal=True) as temporary:
        temporary.write_bytes(source.read_bytes())


def main(fitting: bool) -> None:
    """Lay out all of them, one a core."""
    names = [material.name for material in nacre.materials() if material.kind == "brdf"]
    with terminable(), ThreadPoolExecutor(core_count()) as pool:
        try:
            for name in pool.map(laid_out, names, [fitting] * len(names)):
                print(name, flush=True)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


if __name__ == "__main__":
    if sys.argv[1:] not in ([], ["--openpbr"]):
        raise SystemExit(__doc__)
    try:
        main(len(sys.argv) > 1)
    except KeyboardInterrupt as stop:
        print("gallery: stopped", file=sys.stderr)
        sys.exit(143 if isinstance(stop, Terminated) else 130)
    except (NacreError, OSError) as error:
        print(f"gallery: {error}", file=sys.stderr)
        sys.exit(2)
