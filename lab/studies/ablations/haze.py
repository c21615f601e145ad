"""What OpenPBR 1.2's `specular_haze` gains on measured materials.

Each material is fitted by OpenPBR 1.1 without haze and with it (:mod:`lab.studies.references.
hazy_openpbr`), by the same optimizer (:mod:`nacre.analytic.picture_fit`) from equally many random
starts, and from what the other found, so that the larger model is never further from the pictures
that fits see. Judged is by others: the sphere of :mod:`nacre.mitsuba.sphere`, 128 x 128, under the
package's own environment and under a directional light.

Then haze is fitted again from four corners of its two parameters, to see whether they come out the
same, and a second lobe that is free is fitted from the result, to see what haze leaves.

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
from lab.studies.ablations.haze_tables import Result, figure, tables
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
_SEEN = 0.3, 0.5  # haze and spread of a second lobe that derivatives can see
_CORNERS = ((0.1, 0.2), (0.1, 0.7), (0.6, 0.2), (0.6, 0.7))
_HERE = "lab.studies.ablations.haze"
_FIRSTS = 0, 4, 2, 6, 1, 5, 3, 7  # of every eighth file, in turn
LITTLE = 0.05  # dB that the fit gains, up to which the model without haze is not fitted again

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
    """Two free lobes, from a material with haze, and from one whose second lobe can be seen."""
    values = haze[0]
    near = [TwoLobeOpenPbr.of_haze(each) for each in (values, with_haze(values, *_SEEN))]
    two = fitted(brdf, TwoLobeOpenPbr, 0, seed, near)
    return two if two[1] > haze[1] else (near[0], haze[1])


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
    """The same with haze fitted from the corners, too, and with the bound."""
    brdf, found = load_brdf(result["file"]), result["fits"]
    points = (with_haze(found["without"][0], *each) for each in _CORNERS)
    corners = [fitted(brdf, HazyOpenPbr, 0, seed, [point]) for point in points]
    haze = max(found["haze"], *corners, key=lambda each: each[1])
    fits = {**found, "haze": haze, "two lobes": bound(brdf, haze, seed)}
    return {**result, "fits": fits, "errors": judged(brdf, fits, size), "corners": corners}


@dataclass(frozen=True)
class Job:
    """What is kept of one material in a folder, from one run to the next."""

    path: Path
    folder: Path
    starts: int
    seed: int
    size: int

    def run(self, stage: str) -> Result:
        """A material `compared` or `examined`; raises NacreError if it cannot be."""
        code = code_fingerprint(f"{_HERE}:{stage}")
        settings = repr((nacre.__version__, code, self.starts, self.seed, self.size)).encode()
        digest = hashlib.sha256(self.path.read_bytes() + settings).hexdigest()[:16]
        kept = self.folder / f"{self.path.stem}-{stage}-{digest}.json"
        if kept.is_file():
            found: Result = json.loads(kept.read_text())
            return found
        if stage == "examined":
            found = examined(self.run("compared"), self.seed, self.size)
        else:
            found = compared(self.path, self.starts, self.seed, self.size)
        self.folder.mkdir(parents=True, exist_ok=True)
        with atomic_path(kept, internal=True) as temporary:
            temporary.write_text(json.dumps(found))
        return found


def gained(result: Result) -> float:
    """What haze adds to the PSNR in dB that the fit maximizes."""
    return float(result["fits"]["haze"][1] - result["fits"]["without"][1])


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
    study.add_argument("--examine", type=int, help="only so many that gain most (default: all)")
    options = study.options()
    folders = options.measured or [data("rgl"), data("pretrained", "merl")]
    for folder in folders:
        if not folder.is_dir():
            sys.exit(f"{folder} is no folder: give folders of measured materials by --measured")
    starts, size = (2, 64) if options.quick else (options.starts, 128)
    jobs = [
        Job(path, study.output / "cache", starts, options.seed, size)
        for path in study.few(files(folders)[: options.first])
    ]
    found: dict[Path, Result] = {}
    prevent_oversubscription()
    with ProcessPoolExecutor(options.processes, multiprocessing.get_context("spawn")) as pool:
        for stage in (compared, examined):
            running = {pool.submit(job.run, stage.__name__): job for job in jobs}
            for done in as_completed(running):
                path = running[done].path
                try:
                    found[path] = done.result()
                except NacreError as error:
                    log(f"left out: {error}")
                    continue
                log(path.stem, f"haze gains {gained(found[path]):+.2f} dB in the fit")
            jobs = sorted(
                (job for job in jobs if job.path in found), key=lambda job: -gained(found[job.path])
            )
            jobs = jobs[: options.examine]
    if not found:
        sys.exit("none of the files is a reflectance that nacre can fit")
    results = list(found.values())
    for title, columns, rows in tables(results):
        study.table(columns, rows, title)
    figure(results, study.output / "haze.png")


if __name__ == "__main__":
    main()
