"""Importance sampling: noise of samplers of ours beside Mitsuba's `measured`, and what they cost.

A sphere of a measured material fills the frame, lit by the furnace, an even sky, or by the
museum. All samplers but that of `measured` sample one and the same table, through the plugin
`brdf`, and light is found by sampling the material only. The error is that of a picture of 64 paths
a pixel: the root of the mean, over pixels and channels, of the squared deviation over the square of
the converged value (plus that of a tenth of the picture's mean, for what is nearly black). The
converged picture is the mean of all repetitions, which the deviations of each are corrected for.

Time is that of paths through the scene of :mod:`benchmarks.render`, in rounds in which all take
turns, and relative to `measured` in the same round. Two materials are timed with each sampler of
ours: the table, and a network fitted to it, which is what nacre is used for. Error at equal time is
what is left after the time that `measured` takes for 64 paths.

Run `python -m experiments.sampling [material ...]` from the root of the repository. With `--cache
FILE` results are kept and materials that are in it are not measured again.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

import nacre
from benchmarks.render import scene as timed_scene
from benchmarks.table import markdown
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.geometry import split
from nacre.render.environment import load_environment
from nacre.sampling import GgxLobe, GgxMixture, fit_blinn_phong, fit_lobes
from nacre.sampling.moment import second_moment
from tests.data import list_data, require_data

Figures: TypeAlias = dict[str, dict[str, float]]
"""By sampler: the error in each of :data:`LIGHTS`, and the times of table and network relative to
`measured`."""

MEASURED = "`measured`"
OWN = "the table's own warp"
LIGHTS = ("furnace", "environment")
PATHS = 64
"""A pixel."""
_DARK = 0.1
"""Of the picture's mean: what is darker counts less."""


def fit_plain_ggx(brdf: Brdf) -> GgxMixture:
    """Cosine and visible GGX normals with one share and one roughness, found by search."""
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
    "cosine + Blinn-Phong": fit_blinn_phong,
    "cosine + GGX": fit_plain_ggx,
    "`fit_lobes`": fit_lobes,
}
"""Samplers that are given to the table, by name."""


def sphere(mi: Any, bsdf: Any, light: str, size: int) -> Any:
    """A sphere that touches the frame, lit from all around, sampled by its material only."""
    camera = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    sky = {"type": "constant"}
    if light == "environment":
        pixels = load_environment(require_data("environment", "museum.exr")).pixels
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
    pictures = np.stack(
        [
            np.array(mi.render(scene, spp=PATHS, seed=seed))[covered].astype(np.float64)
            for seed in range(repetitions)
        ]
    )
    converged, variance = pictures.mean(axis=0), pictures.var(axis=0, ddof=1)
    least = (_DARK * converged.mean()) ** 2
    return float(np.sqrt((variance / (converged**2 + least)).mean()))


def relative_times(mi: Any, bsdfs: dict[str, Any], rounds: int, size: int) -> dict[str, float]:
    """Median over rounds of the time of each material relative to `measured`."""
    import drjit as dr

    scenes = {name: timed_scene(mi, bsdf, size) for name, bsdf in bsdfs.items()}
    times: dict[str, list[float]] = {name: [] for name in scenes}
    for seed in range(rounds + 2):
        for name, each in scenes.items():
            dr.sync_thread()
            start = time.perf_counter()
            dr.eval(mi.render(each, spp=PATHS, seed=seed))
            dr.sync_thread()
            times[name].append(time.perf_counter() - start)
    return {
        name: statistics.median(a / b for a, b in zip(found[2:], times[MEASURED][2:], strict=True))
        for name, found in times.items()  # the first two rounds compile
    }


def study(mi: Any, material: str, options: argparse.Namespace) -> Figures:
    """Figures of every sampler on one table: errors, and relative times of table and network."""
    path = require_data("rgl", f"{material}_rgb.bsdf")
    table = nacre.load(path)
    network = nacre.fit(table, nacre.Recipe(inputs="enhanced", epochs=5))
    tables: dict[str, Any] = {
        MEASURED: mi.load_dict({"type": "measured", "filename": str(path)}),
        OWN: nacre.render.bsdf(table),
    }
    networks = {}
    for name, fit in SAMPLERS.items():
        sampled = nacre.load(path)
        sampled.sampler = fit(table)
        tables[name] = nacre.render.bsdf(sampled)
        networks[name] = nacre.render.bsdf(replace(network, sampler=sampled.sampler))
    figures = {
        name: {light: noise(mi, bsdf, light, options.size, options.repetitions) for light in LIGHTS}
        for name, bsdf in tables.items()
    }
    both = tables | {f"{name}, network": bsdf for name, bsdf in networks.items()}
    times = relative_times(mi, both, options.rounds, options.timed_size)
    for name, found in figures.items():
        found["table"] = times[name]
        found["network"] = times.get(f"{name}, network", times[name])
    return figures


def at_equal_time(found: dict[str, float], light: str, kind: str) -> float:
    """Error once as much time has passed as `measured` takes for its paths."""
    return found[light] * math.sqrt(found[kind])


def summary(studies: dict[str, Figures]) -> list[tuple[str, ...]]:
    """A line for each sampler: medians over materials, and how many it beats `measured` on."""
    rows = []
    for name in next(iter(studies.values())):
        each = [figures[name] for figures in studies.values()]
        row = [name, *(f"{statistics.median(f[light] for f in each):.3f}" for light in LIGHTS)]
        for kind in ("table", "network"):
            if kind == "network" and name not in SAMPLERS:
                row += ["", "", ""]
                continue
            row.append(f"{statistics.median(f[kind] for f in each):.2f}")
            for light in LIGHTS:
                errors = [at_equal_time(f, light, kind) for f in each]
                rivals = [figures[MEASURED][light] for figures in studies.values()]
                won = sum(a < b for a, b in zip(errors, rivals, strict=True))
                count = "" if name == MEASURED else f" ({won})"
                row.append(f"{statistics.median(errors):.3f}{count}")
        rows.append(tuple(row))
    return rows


def details(studies: dict[str, Figures]) -> list[tuple[str, ...]]:
    """A line for each material: errors of the same number of paths, furnace / environment."""
    return [
        (material, *(" / ".join(f"{found[x]:.3f}" for x in LIGHTS) for found in figures.values()))
        for material, figures in studies.items()
    ]


def main() -> None:
    """Measure the materials, print two tables."""
    materials = [name.removesuffix("_rgb.bsdf") for name in list_data("rgl", "*_rgb.bsdf")]
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("materials", nargs="*", default=materials, metavar="material")
    parser.add_argument("--size", type=int, default=64, help="pixels a side")
    parser.add_argument("--repetitions", type=int, default=16, help="pictures of each sampler")
    parser.add_argument("--rounds", type=int, default=5, help="of the timing")
    parser.add_argument("--timed-size", type=int, default=96, help="pixels a side")
    parser.add_argument("--cache", type=Path, help="JSON file of results")
    options = parser.parse_args()
    if not options.materials:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")

    mi = nacre.render.mitsuba()
    studies: dict[str, Figures] = {}
    if options.cache and options.cache.exists():
        studies = json.loads(options.cache.read_text())
    for material in options.materials:
        if material not in studies:
            studies[material] = study(mi, material, options)
            if options.cache:
                options.cache.write_text(json.dumps(studies, indent=2))
    equal = "furnace (won)", "environment (won)"
    columns = "sampler", "furnace", "environment", "time, table", *equal, "time, network", *equal
    print(markdown(columns, summary(studies)), end="\n\n")
    print(markdown(("material", *next(iter(studies.values()))), details(studies)))


if __name__ == "__main__":
    main()
