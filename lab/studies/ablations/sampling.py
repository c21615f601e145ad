"""Importance sampling: noise of samplers of ours beside Mitsuba's `measured`, and what they cost.

A sphere of a measured material fills the frame, lit by the furnace, an even sky, or by the
museum. All samplers but that of `measured` sample one and the same table, through the plugin
`brdf`, and light is found by sampling the material only. The error is that of a picture of 64 paths
a pixel: the root of the mean, over pixels and channels, of the squared deviation over the square of
the converged value (plus that of a tenth of the picture's mean, for what is nearly black). The
converged picture is the mean of all repetitions, which the deviations of each are corrected for.

Time is that of paths through the scene of :mod:`lab.studies.speed.render`, in rounds in which all
take turns, relative to `measured` in the same round; medians of three materials. Two things are
timed with each sampler of ours: the table, and a network fitted to it, which is what nacre is used
for. Error at equal time is what is left after the time that `measured` takes for 64 paths; in
parentheses, on how many materials that is less.

Rows of predicted lobes are of the basis that comes with nacre, which was trained without these
materials, or of another neural one (`--basis FILE`). They are not timed: their kernels are those of
the lobes that a search finds.

Run `python -m lab.studies.ablations.sampling [material ...]`. What
was measured is kept with the results; `--timed` without materials, or with some, says what is
timed.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.speed.render import MATERIALS
from lab.studies.speed.render import scene as timed_scene
from lab.studies.study import Study, data, museum, rgl_names
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.errors import NacreError
from nacre.geometry import split
from nacre.latent import find_basis
from nacre.measured.microfacet_warp import microfacet_sampler
from nacre.sampling import GgxLobe, GgxMixture, fit_blinn_phong, fit_lobes
from nacre.sampling.moment import second_moment
from nacre_lab.reproduce.cache import cache_key, code_digest
from nacre_lab.reproduce.samplers import PREDICTED, find_sampler

Results: TypeAlias = dict[str, dict[str, dict[str, dict[str, float]]]]
"""Errors by material, sampler and light; times, relative to those of `measured`, by material,
sampler, and table or network."""

MEASURED = "`measured`"
LIGHTS = ("furnace", "environment")
PATHS = 64
"""A pixel."""
DARK = 0.1
"""Of the picture's mean: what is darker counts less."""


def fit_plain_ggx(brdf: Brdf) -> GgxMixture:
    """Cosine and visible GGX normals with one fraction and one roughness, found by search."""
    moment = second_moment(brdf)
    wi, wo = split(moment.wi), split(moment.wo)
    cosine = wi[2] / math.pi
    best = math.inf, 0.0, 1.0
    for roughness in np.geomspace(0.003, 1.0, 48):
        alpha = (float(roughness),)
        lobe = GgxMixture((GgxLobe((1.0,), alpha, alpha, (0.0,)),)).pdf_components(wi, wo)
        for share in np.linspace(0.0, 0.98, 50):
            second = float((moment.weights / (share * lobe + (1.0 - share) * cosine)).sum())
            best = min(best, (second, float(share), alpha[0]))
    _, share, roughness = best
    return GgxMixture((GgxLobe((share,), (roughness,), (roughness,), (0.0,)),))


SAMPLERS: dict[str, Callable[[Brdf], Sampler]] = {
    "cosine": lambda brdf: CosineSampler(),
    "power iterations": microfacet_sampler,
    "cosine + Blinn-Phong": fit_blinn_phong,
    "cosine + GGX": fit_plain_ggx,
    "`fit_lobes`": fit_lobes,
}
"""Samplers that are given to the table, by name."""


def predicted(name: str) -> dict[str, Callable[[Brdf], Sampler]]:
    """Samplers that a basis predicts, by name."""
    basis = find_basis(name)
    if not basis.predictors:
        raise NacreError(f"{name}: predicts no lobes")
    return {f"`{kind}`": find_sampler(kind, basis) for kind in PREDICTED}


def sphere(mi: Any, bsdf: Any, light: str, size: int) -> Any:
    """A sphere that touches the frame, lit from all around, sampled by its material only."""
    camera = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    sky = {"type": "constant"}
    if light == "environment":
        pixels = museum().pixels
        sky = {"type": "envmap", "bitmap": mi.Bitmap(pixels)}
    integrator = {"type": "direct", "emitter_samples": 0, "bsdf_samples": 1}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator,
            "sensor": {"type": "orthographic", "to_world": camera, "film": film},
            "sphere": {"type": "sphere", "bsdf": bsdf},
            "sky": sky,
        }
    )


def inside(size: int) -> npt.NDArray[np.bool_]:
    """Which pixels of a picture the sphere covers whole."""
    corner = np.abs(np.arange(size) + 0.5 - 0.5 * size) + 0.5
    covered: npt.NDArray[np.bool_] = corner**2 + corner[:, None] ** 2 < (0.5 * size) ** 2
    return covered


def noise(mi: Any, bsdf: Any, light: str, size: int, repetitions: int) -> float:
    """Relative error of a picture."""
    scene, covered = sphere(mi, bsdf, light, size), inside(size)
    return deviation(
        np.stack(
            [
                np.array(mi.render(scene, spp=PATHS, seed=seed))[covered].astype(np.float64)
                for seed in range(repetitions)
            ]
        )
    )


def deviation(pictures: npt.NDArray[np.float64]) -> float:
    """Relative error of pictures of one thing, shape (pictures, pixels, channels)."""
    converged, variance = pictures.mean(axis=0), pictures.var(axis=0, ddof=1)
    floor = (DARK * converged.mean()) ** 2
    return float(np.sqrt((variance / (converged**2 + floor)).mean()))


def relative_times(
    mi: Any, material: str, options: argparse.Namespace
) -> dict[str, dict[str, float]]:
    """Median over rounds of the time with each sampler relative to `measured`."""
    import drjit as dr

    path, table = tabulated(material)
    network = nacre.fit(table, nacre.Recipe(epochs=5))
    bsdfs: dict[tuple[str, str], Any] = {
        (MEASURED, "table"): mi.load_dict({"type": "measured", "filename": str(path)})
    }
    for name, fit in SAMPLERS.items():
        own = fit(table)
        bsdfs[name, "table"] = nacre.mitsuba.bsdf(table.replaced(sampler=own))
        bsdfs[name, "network"] = nacre.mitsuba.bsdf(network.replaced(sampler=own))
    scenes = {key: timed_scene(mi, bsdf, options.timed_size) for key, bsdf in bsdfs.items()}
    times: dict[tuple[str, str], list[float]] = {key: [] for key in scenes}
    for seed in range(options.rounds + 2):
        for key, each in scenes.items():
            dr.sync_thread()
            start = time.perf_counter()
            dr.eval(mi.render(each, spp=PATHS, seed=seed))
            dr.sync_thread()
            times[key].append(time.perf_counter() - start)
    relative: dict[str, dict[str, float]] = {name: {} for name, _ in times}
    for (name, kind), found in times.items():
        pairs = zip(found[2:], times[MEASURED, "table"][2:], strict=True)  # the first two compile
        relative[name][kind] = statistics.median(one / other for one, other in pairs)
    return relative


def errors(mi: Any, material: str, options: argparse.Namespace) -> dict[str, dict[str, float]]:
    """Relative error with each sampler under each light."""
    path, table = tabulated(material)
    bsdfs: dict[str, Any] = {MEASURED: mi.load_dict({"type": "measured", "filename": str(path)})}
    samplers = SAMPLERS | predicted(options.basis)
    for name, fit in samplers.items():
        bsdfs[name] = nacre.mitsuba.bsdf(table.replaced(sampler=fit(table)))
    return {
        name: {light: noise(mi, bsdf, light, options.size, options.repetitions) for light in LIGHTS}
        for name, bsdf in bsdfs.items()
    }


def tabulated(material: str) -> tuple[Path, Brdf]:
    """File and table of a material."""
    path = data("rgl", f"{material}_rgb.bsdf")
    return path, nacre.load(path)


def summary(results: Results) -> list[tuple[str, ...]]:
    """A line for each sampler: medians over materials, and how many it beats `measured` on."""
    rows = []
    for name in next(iter(results["errors"].values())):
        each = [found[name] for found in results["errors"].values()]
        row = [name, *(f"{statistics.median(e[light] for e in each):.3f}" for light in LIGHTS)]
        for kind in ("table", "network"):
            times = [
                found[name][kind]
                for found in results["times"].values()
                if kind in found.get(name, {})
            ]
            if not times:
                row += [""] * 3
                continue
            ratio = statistics.median(times)
            row.append(f"{ratio:.2f}")
            for light in LIGHTS:
                rivals = [found[MEASURED][light] for found in results["errors"].values()]
                equal = [math.sqrt(ratio) * e[light] for e in each]
                won = sum(a < b for a, b in zip(equal, rivals, strict=True))
                count = "" if name == MEASURED else f" ({won})"
                row.append(f"{statistics.median(equal):.3f}{count}")
        rows.append(tuple(row))
    return rows


def details(results: Results) -> list[tuple[str, ...]]:
    """A line for each material: errors of the same number of paths, furnace / environment."""
    return [
        (material, *(" / ".join(f"{e[light]:.3f}" for light in LIGHTS) for e in found.values()))
        for material, found in results["errors"].items()
    ]


def main() -> None:
    """Measure the materials, print two tables."""
    study = Study(__doc__, __file__)
    study.add_argument("materials", nargs="*", metavar="material", help="all by default")
    study.add_argument("--timed", nargs="*", default=list(MATERIALS), metavar="material")
    study.add_argument("--size", type=int, default=64, help="pixels a side")
    study.add_argument("--repetitions", type=int, default=8, help="pictures of each sampler")
    study.add_argument("--rounds", type=int, default=5, help="of the timing")
    study.add_argument("--timed-size", type=int, default=96, help="pixels a side")
    study.add_argument("--basis", default="neural", help="neural basis that predicts lobes")
    options = study.options()
    mi = nacre.mitsuba.mitsuba()
    results: Results = {"errors": {}, "times": {}}
    steps = {
        "errors": (errors, options.materials or study.few(rgl_names())),
        "times": (relative_times, study.few(options.timed, 1)),
    }
    for step, (measure, materials) in steps.items():
        for material in materials:
            facts = [step, material, vars(options) | {"output": "", "data": ""}, code_digest()]
            key = cache_key("sampling", json.loads(json.dumps(facts, default=str)))
            kept = study.cache.arrays(
                key,
                ["found"],
                lambda measure=measure, material=material: {
                    "found": np.array(json.dumps(measure(mi, material, options)))
                },
            )
            results[step][material] = json.loads(str(kept["found"]))
    equal = "furnace (won)", "environment (won)"
    columns = "sampler", *LIGHTS, "time, table", *equal, "time, network", *equal
    study.table(columns, summary(results), "samplers")
    samplers = next(iter(results["errors"].values()))
    study.table(("material", *samplers), details(results), "materials")


if __name__ == "__main__":
    main()
