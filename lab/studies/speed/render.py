"""Rendering speed of the Mitsuba plugins beside Mitsuba's own materials.

One scene, a ball on a plane of the same material under a small environment map, is path-traced with
each material in turn. Rounds are interleaved, so that a busy machine slows all of them alike;
reported are medians over rounds of the time and of its ratio to `roughconductor` (GGX) in the same
round. Every kernel is compiled before the first round; a kernel compiled during a round ends the
benchmark, because its time would be no rendering time.

Run `python -m lab.studies.speed.render [material ...]`: materials are names of RGL tables,
rendered by Mitsuba's `measured`, whose published networks, and short fits of ours, are rendered by
`nbrdf`.
"""

from __future__ import annotations

import json
import os
import platform
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

import numpy as np

import nacre
from lab.studies.study import Study, data
from nacre.mitsuba.mesh import triangle_mesh
from nacre.sampling import BlinnPhongMixture
from nacre_lab.reproduce.throughput import race

BASELINE = "roughconductor"
MATERIALS = ("satin_rosaline", "paper_white", "colodur_napoli_4f")
LOBES = BlinnPhongMixture(specular=0.5, exponent=100.0)
"""Sampler of every network: the published ones come without."""


@dataclass(frozen=True)
class Result:
    """Speed of one material.

    Parameters
    ----------
    material
        Name of the material and of its plugin.
    seconds
        Median wall time of a rendering.
    million_paths_per_second
        Millions of camera paths a second.
    ratio
        Median over rounds of the speed relative to `roughconductor` in the same round.
    spread
        Smallest and largest ratio.
    """

    material: str
    seconds: float
    million_paths_per_second: float
    ratio: float
    spread: tuple[float, float]


def bsdfs(materials: list[str], cooperative: bool) -> dict[str, Any]:
    """BSDFs, or dictionaries of them, by the name to report."""
    found: dict[str, Any] = {
        BASELINE: {"type": "roughconductor", "alpha": 0.2, "distribution": "ggx"},
        "diffuse": {"type": "diffuse"},
        "principled": {"type": "principled", "roughness": 0.3, "specular": 0.5},
    }
    for material in materials:
        table = data("rgl", f"{material}_rgb.bsdf")
        network = nacre.load(data("pretrained", "rgl", f"{material}_rgb.h5"))
        network = network.replaced(sampler=LOBES)
        found[f"{material}, measured"] = {"type": "measured", "filename": str(table)}
        found[f"{material}, nbrdf"] = nacre.mitsuba.bsdf(network)
        truth = nacre.load(table)
        for name, recipe in (
            ("paper inputs", nacre.Recipe(inputs="paper", epochs=5)),
            ("enhanced inputs", nacre.Recipe(epochs=5)),
            ("enhanced inputs and ReLU", nacre.Recipe(activation="relu", epochs=5)),
        ):
            fitted = nacre.fit(truth, recipe).replaced(sampler=LOBES)
            found[f"{material}, nbrdf of {name}"] = nacre.mitsuba.bsdf(fitted)
        if cooperative:
            found[f"{material}, nbrdf cooperative"] = nacre.mitsuba.bsdf(
                network, weights="cooperative"
            )
    return found


def ball(mi: Any, bsdf: Any) -> Any:
    """A dented sphere of 65,000 triangles: a mesh, as the things that people render are."""
    rows, columns = 128, 256
    theta, phi = np.meshgrid(
        np.linspace(1e-3, np.pi - 1e-3, rows), np.linspace(0, 2 * np.pi, columns), indexing="ij"
    )
    radius = 1 + 0.05 * np.sin(8 * theta) * np.sin(8 * phi)
    z = radius * np.cos(theta)
    x, y = (radius * np.sin(theta) * part for part in (np.cos(phi), np.sin(phi)))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    low, high = (corner, corner + columns, corner + 1), (corner + 1, corner + columns)
    faces = np.concatenate([np.stack(low, 1), np.stack([*high, corner + columns + 1], 1)])
    return triangle_mesh(mi, "ball", np.stack([x, y, z], -1), faces, bsdf)


def scene(mi: Any, bsdf: Any, size: int) -> Any:
    """A ball on a plane that fills the frame, both of one material, under a sky with a sun."""
    sky = np.full((32, 64, 3), 0.5, np.float32)
    sky[8:10, 16:18] = 100.0
    look_at = mi.ScalarTransform4f().look_at([0, -4, 1.5], [0, 0, 0], [0, 0, 1])
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    below = mi.ScalarTransform4f().translate([0, 0, -1]).scale(100)
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 4},
            "sensor": {"type": "perspective", "fov": 35, "to_world": look_at, "film": film},
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky)},
            "ball": ball(mi, bsdf),
            "plane": {"type": "rectangle", "to_world": below, "bsdf": bsdf},
        }
    )


def measure(scenes: dict[str, Any], rounds: int, size: int, spp: int) -> list[Result]:
    """Render every scene in every round."""
    paths = size * size * spp / 1e6
    found = race(scenes, BASELINE, rounds=rounds, spp=spp)
    return [
        Result(name, seconds, paths / seconds, median(ratios), (min(ratios), max(ratios)))
        for name, (seconds, ratios) in found.items()
    ]


def rows(results: list[Result]) -> list[tuple[str, ...]]:
    """The results as lines of a table."""
    return [
        (
            r.material,
            f"{r.seconds:.3f}",
            f"{r.million_paths_per_second:.2f}",
            f"{r.ratio:.2f}",
            f"{r.spread[0]:.2f} to {r.spread[1]:.2f}",
        )
        for r in results
    ]


def main() -> None:
    """Parse the command line, measure, print."""
    study = Study(__doc__, __file__)
    study.add_argument("materials", nargs="*", default=list(MATERIALS), metavar="material")
    study.add_argument("--rounds", type=int, default=7)
    study.add_argument("--size", type=int, default=256, help="pixels a side")
    study.add_argument("--spp", type=int, default=64, help="paths per pixel")
    study.add_argument("--variant", default="llvm_ad_rgb")
    study.add_argument("--cooperative", action="store_true", help="also cooperative vectors")
    study.add_argument("--json", action="store_true", help="print JSON instead of a table")
    options = study.options()

    mi = nacre.mitsuba.mitsuba(options.variant)
    materials = bsdfs(list(study.few(options.materials, 1)), options.cooperative)
    scenes = {name: scene(mi, bsdf, options.size) for name, bsdf in materials.items()}
    results = measure(scenes, options.rounds, options.size, options.spp)
    if options.json:
        facts = {
            "variant": mi.variant(),
            "mitsuba": mi.__version__,
            "cores": os.cpu_count(),
            "machine": platform.machine(),
            **{name: getattr(options, name) for name in ("rounds", "size", "spp")},
        }
        print(json.dumps({**facts, "results": [asdict(r) for r in results]}, indent=2))
    else:
        columns = ("material", "s", "M paths/s", f"relative to {BASELINE}", "smallest to largest")
        study.table(columns, rows(results))


if __name__ == "__main__":
    main()
