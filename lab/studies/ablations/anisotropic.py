"""How close networks come to anisotropic materials, by the inputs that they see.

Eight virtual materials, which are formulas of this module: brushed metals of three strengths along
three directions, satin, a car paint whose flakes lie along a direction, and a weave of two crossed
threads. And three virtual measurements of Mitsuba materials on the grids of RGL files, in memory,
as `nacre measure bsdf` makes them.

Protocol: the deterministic sphere of :mod:`nacre.mitsuba.sphere`, 128 x 128, under an environment
map and a directional light, as in `lab.studies.speed.fidelity`. A table has the means over
materials and seeds of each method, and the worst material; another a row per material.
`--pictures` writes a sheet of each first fit.
"""

from __future__ import annotations

import itertools
import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import nacre
from lab.studies.study import (
    PICTURE_ERRORS,
    Study,
    log,
    museum,
    picture_errors,
    prevent_oversubscription,
    triples,
)
from nacre.analytic.ggx import AnisotropicGgx, Ggx
from nacre.array import Components, Floats
from nacre.brdf import Brdf
from nacre.figures import picture
from nacre.measured.rgl import tabulate
from nacre.measuring.virtual import MitsubaBrdf
from nacre.metrics import compare
from nacre.mitsuba.preview import write_bytes
from nacre.sampling import LobeSampledBrdf
from tests.oracles.reflectances import Beckmann

SIZE = 1500
"""Bytes of the weights."""
METHODS = {
    "paper": nacre.Recipe(size=2 * SIZE),
    "paper, gain 32": nacre.Recipe(size=2 * SIZE, gain=32.0),
    "spinning": nacre.Recipe(inputs="spinning", size=SIZE, gain=32.0, precision="half"),
    "enhanced, ReLU": nacre.Recipe(inputs="enhanced", size=SIZE, activation="relu"),
    "enhanced": nacre.Recipe(inputs="enhanced", size=SIZE),
}
"""Recipes by name. The paper's inputs get as many weights in twice the bytes; "spinning" is what
enhanced inputs were before, also with ReLUs."""
TABLE = "table of "
BLACK = (0.0, 0.0, 0.0)
ALUMINUM, STEEL, COPPER = (0.91, 0.92, 0.92), (0.56, 0.57, 0.58), (0.95, 0.64, 0.54)
QUARTER, TURNED = 0.5 * math.pi, math.radians(30.0)


class Sum(LobeSampledBrdf):
    """What several materials reflect together."""

    isotropic = False

    def __init__(self, *parts: Brdf) -> None:
        super().__init__()
        self.parts = parts

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`."""
        values = [part.eval_components(wi, wo) for part in self.parts]
        red, green, blue = (sum(channel) for channel in zip(*values, strict=True))
        return red, green, blue


class Satin(LobeSampledBrdf, Beckmann):
    """Threads along y, off whose highlight nothing but a dark ground is left."""

    def __init__(self) -> None:
        LobeSampledBrdf.__init__(self)
        Beckmann.__init__(self, 0.05, 0.4, 0.12, 0.5)


def brushed(along: float, across: float, angle: float, color: tuple[float, ...]) -> Brdf:
    """A metal with roughnesses along and across an axis; `angle` from x in radians."""
    return AnisotropicGgx(
        diffuse=BLACK, specular=color, roughness_x=along, roughness_y=across, angle=angle
    )


def virtual() -> Iterator[tuple[str, Brdf]]:
    """Name and reflectance of the materials that are formulas."""
    yield "brushed, weak, x", brushed(0.15, 0.3, 0.0, STEEL)
    yield "brushed, middle, x", brushed(0.08, 0.3, 0.0, ALUMINUM)
    yield "brushed, middle, 30 degrees", brushed(0.08, 0.3, TURNED, COPPER)
    yield "brushed, strong, y", brushed(0.04, 0.4, QUARTER, ALUMINUM)
    yield "brushed, strong, 30 degrees", brushed(0.04, 0.4, TURNED, STEEL)
    yield "satin", Satin()
    flakes = AnisotropicGgx(
        diffuse=(0.01, 0.02, 0.06),
        specular=(0.05, 0.12, 0.3),
        roughness_x=0.2,
        roughness_y=0.4,
        angle=TURNED,
    )
    coat = Ggx(diffuse=BLACK, specular=(0.04, 0.04, 0.04), roughness=0.04)
    yield "car paint", Sum(flakes, coat)
    threads = (
        brushed(0.12, 0.5, 0.0, (0.3, 0.06, 0.08)),
        brushed(0.12, 0.5, QUARTER, (0.1, 0.1, 0.2)),
    )
    ground = Ggx(diffuse=(0.12, 0.03, 0.04), specular=(0.02, 0.02, 0.02), roughness=0.6)
    yield "weave", Sum(*threads, ground)


def tabulated() -> Iterator[tuple[str, Brdf]]:
    """Name and reflectance of Mitsuba materials that are measured virtually."""
    for name, bsdf in {
        f"{TABLE}aluminum": _conductor("Al", 0.05, 0.4),
        f"{TABLE}copper": _conductor("Cu", 0.08, 0.3, distribution="beckmann"),
        f"{TABLE}a weave": _blend(
            _blend(_conductor("Ag", 0.1, 0.4), _conductor("Ag", 0.4, 0.1), 0.5),
            {
                "type": "roughplastic",
                "alpha": 0.3,
                "diffuse_reflectance": {"type": "rgb", "value": [0.4, 0.08, 0.1]},
            },
            0.6,
        ),
    }.items():
        yield name, tabulate(MitsubaBrdf(bsdf, name))


def _conductor(metal: str, along: float, across: float, **options: str) -> dict[str, Any]:
    kind = {"type": "roughconductor", "material": metal, "distribution": "ggx"}
    return {**kind, "alpha_u": along, "alpha_v": across, **options}


def _blend(one: dict[str, Any], other: dict[str, Any], weight: float) -> dict[str, Any]:
    return {"type": "blendbsdf", "weight": weight, "one": one, "other": other}


def main() -> None:
    """Print a Markdown table of the methods, and one of the materials."""
    study = Study(__doc__, __file__)
    study.add_argument("--methods", nargs="*", choices=METHODS, default=list(METHODS))
    study.add_argument("--only", help="materials whose name has this in it")
    study.add_argument("--seeds", type=int, default=3, help="fits of each material")
    study.add_argument(
        "--fraction", type=float, default=1.0, help="of the samples that a fit draws"
    )
    study.add_argument("--pictures", action="store_true", help="write a sheet of each first fit")
    options = study.options()
    prevent_oversubscription()
    environment = museum()
    fraction, seeds = (0.1, 1) if options.quick else (options.fraction, options.seeds)
    found: dict[str, dict[str, Floats]] = {name: {} for name in options.methods}
    seconds: dict[str, list[float]] = {name: [] for name in options.methods}
    for name, truth in itertools.chain(virtual(), tabulated()):
        if options.only and options.only not in name:
            continue
        for method in options.methods:
            errors = []
            for seed in range(options.seed, options.seed + seeds):
                start = time.perf_counter()
                fit = nacre.fit(truth, replace(METHODS[method], seed=seed, sample_share=fraction))
                seconds[method].append(time.perf_counter() - start)
                errors.append(picture_errors(truth, fit, environment))
                if options.pictures and seed == options.seed:
                    drawn = picture(compare(truth, fit, environment=environment))
                    write_bytes(drawn, study.output / f"{name} {method}.png")
            found[method][name] = np.mean(errors, axis=0)
            log(name, method, seconds[method][-1], *found[method][name])
    lines = [
        (name, method, *triples(found[method][name]))
        for name in found[options.methods[0]]
        for method in options.methods
    ]
    study.table(("material", "inputs", *PICTURE_ERRORS), lines, "materials")
    rows = []
    for method, by_name in found.items():
        for part, chosen in (
            ("virtual", [e for n, e in by_name.items() if not n.startswith(TABLE)]),
            ("tables", [e for n, e in by_name.items() if n.startswith(TABLE)]),
        ):
            if chosen:
                cells = triples(np.mean(chosen, axis=0), np.min(chosen, axis=0))
                rows.append((method, part, *cells, f"{statistics.median(seconds[method]):.1f}"))
    head = "inputs", "mean of all; worst PSNR", *PICTURE_ERRORS, "seconds a fit"
    study.table(head, rows, "methods")


if __name__ == "__main__":
    main()
