"""Make the library that `make gallery` shows: networks that may be passed on, and OpenPBR forms.

`python scripts/gallery.py DATA`: the networks that the authors of "Neural BRDF Representation and
Importance Sampling" published (`DATA/pretrained/*/*.h5`, MIT), into `out/gallery`, with their
notice; and isotropic tables of the RGL database (`DATA/rgl/*_rgb.bsdf`, CC0), to which networks are
fitted here, into `gallery`. What is there is kept: after a stop the same command goes on.
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
LIBRARY, OURS = ROOT / "out/gallery/library", ROOT / "gallery/fits to RGL"
PUBLISHED = "network: MIT, Sztrajman, Rainer, Ritschel and Weyrich 2021"
FITTED = "measurement: CC0, EPFL RGL material database (Dupuy and Jakob 2018)"
MODEL = "openpbr"


def make(source: Path, folder: Path) -> str:
    """Write a material's network and its OpenPBR form; its name."""
    name = source.stem.removesuffix("_rgb")
    network, standard = (folder / f"{name}{ending}" for ending in (".safetensors", ".json"))
    folder.mkdir(parents=True, exist_ok=True)
    measured = load_brdf(source)
    if not network.exists():
        made = measured if source.suffix == ".h5" else nacre.fit(measured)
        terms = PUBLISHED if source.suffix == ".h5" else FITTED
        nacre.save(made.replaced(source={**(made.source or {}), "terms": terms}), network)
    if not standard.exists():
        nacre.save(fit(measured, MODELS[MODEL]), standard)
    return name


def main() -> None:
    """Make all materials, one a core."""
    data = Path(sys.argv[1])
    published = sorted(data.glob("pretrained/*/*.h5"))
    if published:
        LIBRARY.mkdir(parents=True, exist_ok=True)
        shutil.copy(data / "pretrained/LICENSE", LIBRARY / "LICENSE")
    wanted = [(path, LIBRARY / f"published, {path.parent.name}") for path in published]
    wanted += [(path, OURS) for path in sorted(data.glob("rgl/*_rgb.bsdf"))]
    with ProcessPoolExecutor() as pool:
        for name in pool.map(make, *zip(*wanted, strict=True)):
            print(name, flush=True)


if __name__ == "__main__":
    main()
