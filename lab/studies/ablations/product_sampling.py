"""Sampling an environment: the material, the light, both, and their product, at equal time.

The sphere under the museum is that of :mod:`lab.studies.ablations.sampling`, and so is the error,
but light is found in other ways than by sampling the material only, in an integrator of ours (see
:mod:`nacre_lab.sampling.direct`) that all rows share. Pictures have 64 directions a pixel, or 64
pairs where a row takes one from the material and one from the light. "4 + 4 a hit" finds 8
directions where a path meets the sphere, 4 from the material, and a pixel has 8 paths.

Time is that of the whole process, which other work on the machine changes little, in rounds in
which all take turns, relative to `measured` that samples the material only: medians of rounds, then
of materials. Error at equal time is what is left after the time in which that row finds its 64
directions; in parentheses, on how many materials it is less than that of `fit_lobes` and light, as
renderers combine them. The time of a network is that of one fitted to the table. The second table
has errors by material, and how much brighter the mean picture is than that of `fit_lobes` and
light, which tells a sampler whose density is wrong.

Run `python -m lab.studies.ablations.product_sampling [material ...]`.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from typing import Any, NamedTuple, TypeAlias

import numpy as np

import nacre
from lab.studies.ablations.sampling import MEASURED, PATHS, deviation, inside, sphere, tabulated
from lab.studies.speed.render import MATERIALS
from lab.studies.study import Study, museum, progress, rgl_names
from nacre.sampling import fit_lobes
from nacre_lab.reproduce.cache import cache_key, code_digest
from nacre_lab.sampling.direct import Product, Resampling, Separate, Strategy, integrator
from nacre_lab.sampling.light_cells import LightCells
from nacre_lab.sampling.training import train

Found: TypeAlias = dict[str, tuple[float, float, float]]
"""Error, time relative to `measured`, and mean of the pictures by row."""


class Row(NamedTuple):
    """What is measured."""

    sampler: str  # of MEASURED, "`fit_lobes`", "learned"
    way: str
    strategy: Strategy
    hits: int = PATHS  # paths of a pixel


BASELINE = MEASURED, "material"
RIVAL = "`fit_lobes`", "material and light"
NETWORK = "network: "


def rows() -> list[Row]:
    """All rows, for the museum."""
    whole, cells = (LightCells(museum(), count) for count in (1, 128))
    return [
        Row(*BASELINE, Separate(None)),
        Row(MEASURED, RIVAL[1], Separate(whole)),
        Row("learned", "material", Separate(None)),
        Row("`fit_lobes`", "material", Separate(None)),
        Row(*RIVAL, Separate(whole)),
        Row("`fit_lobes`", "one of the two", Product(whole)),
        Row("`fit_lobes`", "resampled from 4", Resampling(whole, 2)),
        Row("`fit_lobes`", "resampled from 8", Resampling(whole, 4)),
        Row("`fit_lobes`", "product, 128 cells, 4 + 4 a hit", Product(cells, 4, 4), 8),
    ]


def bsdfs(mi: Any, material: str, options: argparse.Namespace) -> dict[str, Any]:
    """BSDFs by the sampler of a row, and that of a network where this material has one."""
    path, table = tabulated(material)
    lobes = fit_lobes(table)
    found = {
        MEASURED: mi.load_dict({"type": "measured", "filename": str(path)}),
        "`fit_lobes`": nacre.mitsuba.bsdf(table.replaced(sampler=lobes)),
    }
    if material in options.learned:
        learned = train(table, steps=options.steps, seed=options.seed, progress=progress)
        found["learned"] = nacre.mitsuba.bsdf(table.replaced(sampler=learned))
    if material in options.timed:
        network = nacre.fit(table, nacre.Recipe(epochs=5)).replaced(sampler=lobes)
        found[NETWORK] = nacre.mitsuba.bsdf(network)
    return found


def measure(mi: Any, material: str, options: argparse.Namespace) -> Found:
    """All rows of a material, and those of a network that was fitted to it."""
    import drjit as dr

    made, covered = bsdfs(mi, material, options), inside(options.size)
    scenes = {name: sphere(mi, bsdf, "environment", options.size) for name, bsdf in made.items()}
    turns: dict[str, tuple[Row, str]] = {}
    for row in rows():
        if row.sampler in made:
            turns[label(row)] = row, row.sampler
        if row.sampler == "`fit_lobes`" and NETWORK in made:
            turns[NETWORK + row.way] = row, NETWORK
    integrators = {key: integrator(row.strategy, made[of]) for key, (row, of) in turns.items()}
    pictures: dict[str, list[Any]] = {key: [] for key in turns}
    times: dict[str, list[float]] = {key: [] for key in turns}
    for seed in range(-1, options.repetitions):  # the first compiles
        for number, (key, (row, of)) in enumerate(turns.items()):
            dr.sync_thread()
            start = time.process_time()
            picture = mi.render(
                scenes[of], integrator=integrators[key], spp=row.hits, seed=seed % 2**31
            )
            dr.eval(picture)
            dr.sync_thread()
            if seed >= 0:
                times[key].append(time.process_time() - start)
                pictures[key].append(np.array(picture)[covered].astype(np.float64))
            done = (seed + 1) * len(turns) + number + 1
            progress(material, done, (options.repetitions + 1) * len(turns), key)
    base = times[" ".join(BASELINE)]
    return {
        key: (
            deviation(np.stack(pictures[key])),
            statistics.median(a / b for a, b in zip(times[key], base, strict=True)),
            float(np.mean(pictures[key])),
        )
        for key in turns
    }


def brighter(found: Found, key: str) -> float:
    """Than the pictures of :data:`RIVAL`."""
    return found[key][2] / found[" ".join(RIVAL)][2] - 1.0


def label(row: Row) -> str:
    """The key of its results."""
    return f"{row.sampler} {row.way}"


def summary(results: dict[str, Found]) -> list[tuple[str, ...]]:
    """A line for each row: medians over materials, and how often it beats the rival."""

    def equal(found: Found, key: str) -> float:
        error, ratio, _ = found[key]
        return error * math.sqrt(ratio)

    def cells(key: str, rival: str) -> list[str]:
        having = [found for found in results.values() if key in found]
        if not having:
            return ["", "", ""]
        each = [equal(found, key) for found in having]
        won = sum(a < equal(found, rival) for a, found in zip(each, having, strict=True))
        error, ratio = (statistics.median(found[key][i] for found in having) for i in (0, 1))
        count = "" if key == rival else f" ({won} of {len(having)})"
        return [f"{error:.3f}", f"{ratio:.2f}", f"{statistics.median(each):.3f}{count}"]

    lines = []
    for row in rows():
        ours = row.sampler == RIVAL[0]
        network = cells(NETWORK + row.way, NETWORK + RIVAL[1])[1:] if ours else ["", ""]
        lines.append((row.sampler, row.way, *cells(label(row), " ".join(RIVAL)), *network))
    return lines


def main() -> None:
    """Measure the materials, print two tables."""
    study = Study(__doc__, __file__)
    study.add_argument("materials", nargs="*", metavar="material", help="all by default")
    study.add_argument("--timed", nargs="*", default=list(MATERIALS), metavar="material")
    study.add_argument("--learned", nargs="*", default=list(MATERIALS), metavar="material")
    study.add_argument("--size", type=int, default=48, help="pixels a side")
    study.add_argument("--repetitions", type=int, default=3, help="pictures of each row")
    study.add_argument("--steps", type=int, default=400, help="of the learned sampler's training")
    options = study.options()
    mi = nacre.mitsuba.mitsuba()
    results: dict[str, Found] = {}
    for material in options.materials or study.few(rgl_names()):
        facts = [
            material,
            vars(options) | {"output": "", "data": "", "materials": ""},
            code_digest(),
        ]
        key = cache_key("product sampling", json.loads(json.dumps(facts, default=str)))
        kept = study.cache.arrays(
            key,
            ["found"],
            lambda material=material: {
                "found": np.array(json.dumps(measure(mi, material, options)))
            },
        )
        results[material] = json.loads(str(kept["found"]))
    columns = "sampler", "directions from", "noise", "time", "equal time"
    study.table((*columns, "time, network", "equal time"), summary(results), "rows")
    details = [
        (
            name,
            *(f"{found[name][0]:.3f} / {brighter(found, name):+.1%}" for found in results.values()),
        )
        for name in map(label, rows())
        if all(name in found for found in results.values())
    ]
    study.table(("row", *results), details, "materials")


if __name__ == "__main__":
    main()
