"""How close standard materials, closures and tables come to measured materials, and how large.

Protocol: the deterministic sphere of :mod:`nacre.mitsuba.sphere`, 128 x 128, under the museum
environment and a directional light; every row is a material as its file holds it, written and read
back. Fits see neither the museum nor its pictures. GGX and SGD are fitted on samples, with the loss
gain of :data:`nacre_lab.reproduce.methods.GAIN`, as in docs/results/fidelity.md. With `--studio`
the environment is the package's own; `--files` takes materials from other files, such as car
paints.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

import nacre
from lab.studies.study import Study, log, museum, rgl_tables
from nacre import analytic
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.figures import picture
from nacre.formats import load_brdf, save
from nacre.metrics import compare
from nacre.mitsuba.preview import write_bytes
from nacre.targets import TARGETS
from nacre_lab.reproduce.methods import GAIN

Made = tuple[Brdf, int]
"""A material as its file holds it, and the bytes of that."""


def _stored(brdf: Brdf, ending: str) -> Made:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"material{ending}")
        save(brdf, path)
        return load_brdf(path), path.stat().st_size


def _model(name: str, **options: float) -> Callable[[Brdf], Made]:
    return lambda brdf: _stored(analytic.fit(brdf, MODELS[name], **options), ".json")


def _target(name: str) -> Callable[[Brdf], Made]:
    def made(brdf: Brdf) -> Made:
        target = TARGETS[name]()
        held = target.held(brdf)
        return held, sum(map(len, target.files(held, "material").values()))

    return made


METHODS: Mapping[str, Callable[[Brdf], Made]] = {
    "GGX": _model("ggx", gain=GAIN),
    "SGD": _model("sgd", gain=GAIN),
    "glTF (.glb)": _target("gltf"),
    "Principled (script)": _target("principled"),
    "OpenPBR (.mtlx)": _target("openpbr"),
    "closure mixture (add-on's .json)": _model("closures"),
    "MDL table (.mbsdf, 45 x 45 x 90)": _target("mdl"),
    "network (.safetensors)": lambda brdf: _stored(nacre.fit(brdf), ".safetensors"),
}


def main() -> None:
    """Print a table of means and worst materials, and one of all materials."""
    study = Study(__doc__, __file__)
    study.add_argument("--studio", action="store_true", help="light of the package's own map")
    study.add_argument("--files", type=Path, nargs="+", help="materials (default: RGL tables)")
    study.add_argument("--methods", nargs="+", choices=METHODS, help="only these")
    study.add_argument("--pictures", action="store_true", help="write a sheet of each fit")
    options = study.options()
    environment = None if options.studio else museum()
    paths = study.few(options.files or rgl_tables())
    part = "studio" if options.studio else ""
    rows, single, kept = [], [], {}
    for name in options.methods or METHODS:
        errors, sizes, seconds = [], [], []
        for path in paths:
            truth = load_brdf(path)
            start = time.perf_counter()
            fit, nbytes = METHODS[name](truth)
            seconds.append(time.perf_counter() - start)
            sizes.append(nbytes)
            found = compare(truth, fit, environment=environment, size=64 if options.quick else 128)
            errors.append([x for e in found.lights for x in (e.errors.psnr, e.errors.flip)])
            if options.pictures:
                write_bytes(picture(found), study.output / f"{path.stem} {name.split()[0]}.png")
            log(name, path.stem, f"{seconds[-1]:.1f} s", *(f"{x:.3f}" for x in errors[-1]))
        kept[name] = errors
        cells = []
        for light in (0, 2):
            psnr, flip = np.array(errors)[:, light], np.array(errors)[:, light + 1]
            cells += [f"{psnr.mean():.1f} ({psnr.min():.1f})", f"{flip.mean():.3f}"]
        rows.append((name, *cells, f"{np.median(sizes):,.0f}", f"{np.median(seconds):.1f}"))
        single.append((name, *(f"{e[0]:.1f} / {e[2]:.1f}" for e in errors)))
    lights = "environment", "directional"
    head = [f"{light}: {what}" for light in lights for what in ("PSNR (worst)", "FLIP")]
    study.table(("means", *head, "bytes", "seconds"), rows, part)
    names = [path.stem.removesuffix("_rgb") for path in paths]
    study.table(("PSNR, environment / directional", *names), single, f"{part} materials".strip())
    (study.output / "errors.json").write_text(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main()
