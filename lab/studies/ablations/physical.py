"""What `nacre fit --physical` costs, and whether its networks are physical.

Errors: PSNR of the sphere protocol, 128 x 128, under the environment and the directional light, of

- the projection (reciprocal and energy-limited, see :mod:`nacre.sampling.projection`), against the
  table;
- an unconstrained fit with enhanced inputs, against its own target, the table;
- a physical fit, against its own target, the projection, and against the table.

Facts of the same fits: largest albedo of the table up to 85 degrees, by random points; bound of the
physical network's albedo, and the factor that it was scaled by; reciprocity error of the table and
of the network; second moment of a network's own sampler relative to the squared albedo, which is
about 1 where nothing varies, and seconds of a fit, of enhanced and of physical ones.

Materials are the RGL tables and two anisotropic ones; `--set properties` makes draft fits of twenty
materials (tables, published networks, made ones) and ends with an error if one of them is not
reciprocal to the last bit, positive, and below 1 in albedo, at points that the fit does not use.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import nacre
from lab.studies.study import TABULATED, Study, data, log, museum, picture_errors, rgl_tables
from nacre.brdf import Brdf
from nacre.geometry import join, split, uniform_hemisphere
from nacre.metrics.physics import albedo, reciprocity_error
from nacre.sampling.moment import second_moment
from nacre.sampling.projection import Projection
from tests.oracles.reflectances import Beckmann, Glossy

VIEWS = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 88.0, 89.5])
ANISOTROPIC = {
    "glossy, 0.15 x 0.5": Glossy(0.1, 0.3, 0.15, 0.5),
    "metal, 0.1 x 0.4": Beckmann(0.0, 1.0, 0.1, 0.4),
}
MADE = {
    "diffuse": Glossy(0.8, 0.0, 0.5),
    "glossy, 0.3": Glossy(0.2, 0.05, 0.3),
    "sharp, 0.03": Glossy(0.1, 0.5, 0.03),
    "metal, 0.05": Beckmann(0.0, 1.0, 0.05),
}


def main() -> None:
    """Print the tables of the chosen set."""
    study = Study(__doc__, __file__)
    study.add_argument("--set", choices=["cost", "properties"], default="cost")
    study.add_argument("--preset", default="standard", help="of the fits whose cost is measured")
    study.add_argument("--materials", choices=["isotropic", "anisotropic", "all"], default="all")
    options = study.options()
    if options.set == "properties":
        _properties(study)
    else:
        _cost(study, options)


def _cost(study: Study, options: argparse.Namespace) -> None:
    environment, errors, facts = museum(), [], []
    recipe = nacre.Recipe.preset(options.preset, inputs="enhanced", seed=options.seed)
    physical = replace(recipe, inputs="paper", physical=True)
    materials: list[tuple[str, Brdf]] = []
    if options.materials != "anisotropic":
        materials += [(path.stem, nacre.load(path)) for path in rgl_tables()]
    if options.materials != "isotropic":
        materials += ANISOTROPIC.items()
    sums = []
    for name, truth in study.few(materials):
        nacre.fit(truth, replace(recipe, epochs=1, samples=4000))  # compiles the kernel
        projected = Projection(truth)
        start = time.perf_counter()
        plain = nacre.fit(truth, recipe)
        middle = time.perf_counter()
        fitted = nacre.fit(truth, physical)
        end = time.perf_counter()
        pairs = (
            (truth, projected),
            (truth, plain),
            (projected, fitted),
            (truth, fitted),
        )
        found = [picture_errors(a, b, environment) for a, b in pairs]
        sums.append([[e[2], e[5]] for e in found])
        errors.append((name, *(f"{e[2]:.1f} / {e[5]:.1f}" for e in found)))
        kept = fitted.metadata["physical"]
        facts.append(
            (
                name,
                f"{np.nanmax(albedo(truth, VIEWS[:-2]).value):.3f}",
                f"{kept['albedo_bound']:.3f}",
                f"{kept['factor']:.4f}",
                f"{float(reciprocity_error(truth).value):.3f}",
                f"{float(reciprocity_error(fitted).value):g}",
                f"{_moment(plain):.3f}",
                f"{_moment(fitted):.3f}",
                f"{middle - start:.1f}",
                f"{end - middle:.1f}",
            )
        )
        log(*errors[-1], *facts[-1][1:])
    mean = np.mean(sums, axis=0)
    errors.append(("mean", *(f"{a:.1f} / {b:.1f}" for a, b in mean)))
    head = (
        "PSNR, environment / directional",
        "projection to table",
        "enhanced to table",
        "physical to projection",
        "physical to table",
    )
    study.table(head, errors, "cost")
    head = (
        "",
        "largest albedo of the table",
        "bound of the network's",
        "factor",
        "reciprocity error of the table",
        "of the network",
        "second moment of the sampler, enhanced",
        "physical",
        "seconds, enhanced",
        "seconds, physical",
    )
    study.table(head, facts, "facts")


def _properties(study: Study) -> None:
    u = np.random.default_rng(7).random((4, 20_000))
    wi, wo = (join(uniform_hemisphere(u[k], u[k + 1])) for k in (0, 2))
    rows, wrong = [], []
    for name, truth in study.few(list(_twenty()), 3):
        fitted = nacre.fit(truth, nacre.Recipe.preset("draft", physical=True))
        f = fitted.eval(wi, wo)
        difference = float(np.abs(f - fitted.eval(wo, wi)).max())
        seen = albedo(fitted, VIEWS, 0.4)
        kept = fitted.metadata["physical"]
        above = float((seen.value - 4.0 * seen.error).max())
        if difference or f.min() <= 0.0 or above > 1.0 or kept["albedo_bound"] > 1.0:
            wrong.append(name)
        numbers = float(seen.value.max()), kept["albedo_bound"], kept["factor"]
        rows.append((name, f"{difference:g}", f"{f.min():.2g}", *(f"{x:.4f}" for x in numbers)))
        log(*rows[-1])
    head = "", "f(wi, wo) - f(wo, wi)", "smallest f", "largest albedo", "its bound", "factor"
    study.table(head, rows, "properties")
    if wrong:
        sys.exit(f"not physical: {', '.join(wrong)}")


def _twenty() -> Iterator[tuple[str, Brdf]]:
    for path in rgl_tables():
        yield path.stem, nacre.load(path)
    for name in TABULATED[:7]:
        yield f"network {name}", nacre.load(data("pretrained", "merl", f"{name}.h5"))
    yield from (MADE | ANISOTROPIC).items()


def _moment(brdf: Brdf) -> float:
    """Second moment of f cos / p of a reflectance's own sampler, about 1 where nothing varies."""
    moment, sampler = second_moment(brdf, 1), brdf.sampler
    density = sampler.pdf_components(split(moment.wi), split(moment.wo))
    return float((moment.weights / np.maximum(density, 1e-30)).sum())


if __name__ == "__main__":
    main()
