"""What OpenPBR 1.2's `specular_haze` gains on measured materials.

Each material is fitted by OpenPBR 1.1 without haze, with it, and with a second lobe that is free
(:mod:`lab.studies.references.hazy_openpbr`), by the same optimizer (:mod:`nacre.analytic.
picture_fit`) from equally many random starts. Each model also starts from what the others found, so
that a larger model is never further from the pictures that fits see. Judged is by others: the
sphere of :mod:`nacre.mitsuba.sphere`, 128 x 128, under the package's own environment and under a
directional light. Where haze helps the fit, it is fitted again from four corners of its two
parameters, to see whether they come out the same.

    python -m lab.studies.ablations.haze                     # RGL tables and MERL networks
    python -m lab.studies.ablations.haze --measured FOLDER   # any files that nacre reads

Results are kept per material: a run that was stopped goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

import nacre
from lab.studies.ablations.haze_tables import figure, tables
from lab.studies.references.hazy_openpbr import HAZE, SPREAD, HazyOpenPbr, TwoLobeOpenPbr, wider
from lab.studies.study import Study, data, log, prevent_oversubscription
from nacre.analytic.model import AnalyticBrdf
from nacre.analytic.picture_fit import fit_pictures
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.io.files import atomic_path
from nacre.metrics.metrics import image_errors
from nacre.mitsuba.sphere import render_sphere, standard_lights
from nacre.runtime.code_fingerprint import code_fingerprint
from nacre.runtime.progress import silent
from nacre.standard.openpbr import OpenPbr

MODELS: Mapping[str, type[AnalyticBrdf]] = {
    "without": OpenPbr,
    "haze": HazyOpenPbr,
    "two lobes": TwoLobeOpenPbr,
}
_NEAR = 0.1, 0.3  # haze and spread, added to a material without
CORNERS = ((0.1, 0.2), (0.1, 0.7), (0.6, 0.2), (0.6, 0.7))
_HERE, _DECIDING = "lab.studies.ablations.haze", ("compared", "examined")
_FIRSTS = 0, 4, 2, 6, 1, 5, 3, 7
LITTLE = 0.05  # dB that the fit gains, up to which the model without haze is not fitted again
WORTH = 0.5  # dB that the fit gains, above which it is repeated from the corners

Result: TypeAlias = dict[str, Any]
"""What is found about a material: `fits` and `errors` by model, and more."""

Values: TypeAlias = dict[str, Any]
Found: TypeAlias = tuple[Values, float]
"""Parameters, and the mean PSNR in dB of both kinds of pictures that the fit compares."""


def fitted(
    brdf: Brdf, model: type[AnalyticBrdf], starts: int, seed: int, near: Sequence[Values] = ()
) -> Found:
    """The best of a model from random starts, and from near some values."""
    with np.errstate(all="ignore"):
        values, facts = fit_pictures(brdf, model, starts, seed, silent, near)
    return values, 0.5 * (facts["views_psnr"] + facts["directional_psnr"])


def with_haze(values: Values, haze: float, spread: float) -> Values:
    return {**values, HAZE: haze, SPREAD: spread}


def without_haze(values: Values) -> Values:
    """The lobe of a material with haze that weighs more, as a material of one."""
    core = {name: value for name, value in values.items() if name not in (HAZE, SPREAD)}
    if values[HAZE] > 0.5:
        core["specular_roughness"] = wider(values["specular_roughness"], values[SPREAD])
    return core


def pair(brdf: Brdf, starts: int, seed: int) -> dict[str, Found]:
    """Both models fitted to a material; each also starts from what the other found."""
    without = fitted(brdf, OpenPbr, starts, seed)
    haze = fitted(brdf, HazyOpenPbr, starts, seed, [with_haze(without[0], *_NEAR)])
    if haze[1] > without[1] + LITTLE:
        again = fitted(brdf, OpenPbr, 0, seed, [without_haze(haze[0])])
        without = max(without, again, key=lambda found: found[1])
    if haze[1] < without[1]:  # what is left is the special case
        haze = with_haze(without[0], 0.0, _NEAR[1]), without[1]
    return {"without": without, "haze": haze}


def bound(brdf: Brdf, haze: Found, seed: int) -> Found:
    """Two free lobes, from a material with haze."""
    special = TwoLobeOpenPbr.of_haze(haze[0])
    two = fitted(brdf, TwoLobeOpenPbr, 0, seed, [special])
    return two if two[1] > haze[1] else (special, haze[1])


def judged(brdf: Brdf, found: Mapping[str, Found], size: int) -> dict[str, list[float]]:
    """PSNR and FLIP under the environment, then under the directional light, of every model."""
    errors: dict[str, list[float]] = {name: [] for name in found}
    for light in standard_lights(None).values():
        truth, mask = render_sphere(brdf, light, size)
        for name, (values, _) in found.items():
            picture, _ = render_sphere(MODELS[name](**values), light, size)
            measured, _ = image_errors(truth, picture, mask)
            errors[name] += [measured.psnr, measured.flip]
    return errors


def compared(path: Path, starts: int, seed: int, size: int) -> Result:
    """A material without and with haze."""
    brdf = load_brdf(path)
    found = pair(brdf, starts, seed)
    name = path.stem.removesuffix("_rgb")
    errors = judged(brdf, found, size)
    return {"name": name, "file": str(path), "fits": found, "errors": errors}


def examined(result: Result, seed: int, size: int) -> Result:
    """The same with the bound, and with fits from the corners where haze helps."""
    brdf, found = load_brdf(result["file"]), result["fits"]
    two = {"two lobes": bound(brdf, found["haze"], seed)}
    corners = []
    if found["haze"][1] - found["without"][1] > WORTH:
        points = (with_haze(found["without"][0], *each) for each in CORNERS)
        corners = [fitted(brdf, HazyOpenPbr, 0, seed, [point]) for point in points]
    errors = result["errors"] | judged(brdf, two, size)
    return result | {"fits": found | two, "errors": errors, "corners": corners}


@dataclass(frozen=True)
class Job:
    """What is kept of one material in a folder, from one run to the next."""

    path: Path
    folder: Path
    code: str  # version of nacre, and fingerprint of the study
    starts: int
    seed: int
    size: int

    def run(self, full: bool) -> Result:
        """A material compared, or examined if `full`; raises NacreError if it cannot be."""
        settings = repr((self.code, self.starts, self.seed, self.size)).encode()
        digest = hashlib.sha256(self.path.read_bytes() + settings).hexdigest()[:16]
        kept = self.folder / f"{self.path.stem}-{digest}{'-full' * full}.json"
        if kept.is_file():
            found: Result = json.loads(kept.read_text())
            return found
        if full:
            found = examined(self.run(False), self.seed, self.size)
        else:
            found = compared(self.path, self.starts, self.seed, self.size)
        self.folder.mkdir(parents=True, exist_ok=True)
        with atomic_path(kept, internal=True) as temporary:
            temporary.write_text(json.dumps(found))
        return found


def files(folders: Sequence[Path]) -> list[Path]:
    """Files of the folders; from those with many, every eighth comes first, then every fourth."""
    found = []
    for folder in folders:
        inside = sorted(path for path in folder.iterdir() if path.is_file())
        inside = [path for path in inside if not path.name.startswith(".")]
        firsts = _FIRSTS if len(inside) > 20 else (0,)
        found += [path for first in firsts for path in inside[first :: len(firsts)]]
    return found


def main() -> None:
    """Write the tables and the picture."""
    study = Study(__doc__, __file__)
    study.add_argument("--measured", type=Path, nargs="+", help="folders of files that nacre reads")
    study.add_argument("--starts", type=int, default=4, help="random starts per model (default: 4)")
    study.add_argument("--first", type=int, help="only so many files (default: all)")
    study.add_argument("--processes", type=int, default=2, help="at a time (default: 2)")
    options = study.options()
    folders = options.measured or [data("rgl"), data("pretrained", "merl")]
    for folder in folders:
        if not folder.is_dir():
            sys.exit(f"{folder} is no folder: give folders of measured materials by --measured")
    starts, size = (2, 64) if options.quick else (options.starts, 128)
    code = nacre.__version__ + code_fingerprint(*(f"{_HERE}:{name}" for name in _DECIDING))
    jobs = [
        Job(path, study.output / "cache", code, starts, options.seed, size)
        for path in study.few(files(folders)[: options.first])
    ]
    found: dict[Path, Result] = {}
    prevent_oversubscription()
    with ProcessPoolExecutor(options.processes, multiprocessing.get_context("spawn")) as pool:
        for full in (False, True):
            running = {pool.submit(job.run, full): job.path for job in jobs}
            for done in as_completed(running):
                path = running[done]
                try:
                    found[path] = done.result()
                except NacreError as error:
                    log(f"left out: {error}")
                    jobs = [job for job in jobs if job.path != path]
                    continue
                gains = [
                    fit[1] - found[path]["fits"]["without"][1]
                    for fit in found[path]["fits"].values()
                ]
                log(path.stem, *(f"{gain:+.2f} dB" for gain in gains[1:]), "in the fit")
    if not found:
        sys.exit("none of the files is a reflectance that nacre can fit")
    results = [found[job.path] for job in jobs]
    for title, columns, rows in tables(results):
        study.table(columns, rows, title)
    figure(results, study.output / "haze.png")


if __name__ == "__main__":
    main()
