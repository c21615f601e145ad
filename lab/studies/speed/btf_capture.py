"""Virtual capture of one material of each family, and Mitsuba's path integrator on one surface.

What counts is a sample: one path, seen under one light. The tracer follows a path for all lights at
once, at all of Bonn's pairs; Mitsuba renders one light after another, in wavefronts, here of one
view of a diffuse surface, of which both get the same triangles.
`python -m lab.studies.speed.btf_capture --help`.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from lab.studies.study import Study, log
from nacre.measured.textures import BONN
from nacre.mitsuba import llvm
from nacre.runtime.parallel import core_count
from nacre.textures.capture import Mesostructure, capture, find
from tests.oracles.mitsuba_capture import (
    CELLS,
    bumps,
    camera_rays,
    lit,
    mesh,
    path_integrator,
)

FAMILIES = ("carpet", "fabric", "felt", "leather", "stone", "wallpaper", "wood")
VIEW = 60
"""Of Bonn's directions, for Mitsuba."""
LIGHTS = 8
"""Of them, for Mitsuba."""


def surface() -> Mesostructure:
    """A diffuse one, of one albedo a cell."""
    return bumps(0.05, np.random.default_rng(1).uniform(0.1, 0.9, (CELLS, CELLS, 3)))


def captured(one: Mesostructure, texels: int, samples: int) -> tuple[float, int]:
    """Seconds at all of Bonn's pairs, and samples."""
    wi, wo = BONN.pairs()
    start = time.perf_counter()
    capture(one, wi, wo, texels, samples=samples)
    return time.perf_counter() - start, texels**2 * samples * len(wi)


def by_mitsuba(mi: Any, texels: int, samples: int) -> tuple[float, int]:
    """Seconds of the integrator alone, and samples; kernels are compiled beforehand."""
    import drjit as dr

    bsdf = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "face_albedo"}}
    shape, integrator = mesh(mi, surface(), bsdf), path_integrator(mi)
    random, view = np.random.default_rng(0), BONN.directions[VIEW]
    ray = camera_rays(mi, surface(), view, texels, samples, random)
    seconds = 0.0
    for index, light in enumerate(BONN.directions[:: len(BONN.directions) // LIGHTS][: LIGHTS + 1]):
        scene, sampler = lit(mi, shape, light), mi.load_dict({"type": "independent"})
        sampler.seed(index, texels**2 * samples)
        start = time.perf_counter()
        radiance, _, _ = integrator.sample(scene, sampler, ray)
        dr.eval(radiance)
        dr.sync_thread()
        seconds += (time.perf_counter() - start) * (index > 0)
    return seconds, texels**2 * samples * LIGHTS


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--texels", type=int, default=32, help="of a row (default: %(default)s)")
    study.add_argument("--samples", type=int, default=64, help="paths (default: %(default)s)")
    options = study.options()
    size = options.texels, options.samples
    captured(surface(), 1, 1)  # compiles
    rows: list[tuple[str, float, int]] = []
    for family in study.few(FAMILIES):
        rows.append((f"{family}12", *captured(find(f"{family}12").build(), *size)))
        log(*rows[-1])
    rows.append(("diffuse bumps", *captured(surface(), *size)))
    if llvm.prepare() is not None:
        import mitsuba as mi

        mi.set_variant("llvm_ad_rgb")
        rows.append(("the same by Mitsuba", *by_mitsuba(mi, *size)))
    lines = [(name, f"{s:.2f}", f"{count / s / 1e6:.0f}") for name, s, count in rows]
    study.table(
        ("", "seconds", "million samples a second"),
        lines,
        note=f"{size[0]} x {size[0]} texels, {size[1]} paths a view and texel; "
        f"{core_count()} cores.",
    )


if __name__ == "__main__":
    main()
