"""What a fit can reach in a given time: the search behind `nacre fit --preset`.

Every setting of samples, batch, learning rate and epochs fits the paper's network to every material
of :func:`lab.studies.study.materials`, one after the other on one core. A line of the table has the
median seconds of drawing and training, and the held-out loss relative to the standard recipe
(geometric mean over the materials), on samples that no fit has seen. "front" marks lines that no
faster one beats.

Run `python -m lab.studies.ablations.fit_budgets [--inputs enhanced] [--materials N]` from the root
of the repository; about an hour without `--quick`, which leaves out what takes longer than the
standard.
"""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lab.studies.speed.fit import attempt
from lab.studies.study import Study, log, materials, prevent_oversubscription
from nacre import Recipe
from nacre.neural.fit_data import SAMPLES
from nacre.neural.recipe import PRESETS
from nacre.neural.samples import draw

UNSEEN = 100_000
"""Samples that losses are measured on."""


def settings(inputs: str, quick: bool) -> Iterator[Recipe]:
    """The presets, and what stands around them."""
    for name in PRESETS:
        if not (quick and name == "best"):
            yield Recipe.preset(name, inputs=inputs)
    steps = (3_000, 6_000, 12_000, 25_000)
    for share, count in itertools.product((0.125, 0.25, 0.5, 1.0), steps):
        yield _recipe(inputs, share, 512, 1e-2, count)
    for batch, rate, count in (
        *((512, rate, count) for rate in (5e-3, 2e-2, 3e-2) for count in (12_000, 16_000, 25_000)),
        *((256, rate, count) for rate in (5e-3, 1e-2, 2e-2) for count in (24_000, 50_000)),
        *((128, rate, 45_000) for rate in (1e-2, 2e-2)),
        *((1024, 2e-2, count) for count in (3_000, 6_000, 12_500)),
    ):
        yield _recipe(inputs, 0.25, batch, rate, count)
    for batch, rate, count in (
        *((512, rate, 125_000) for rate in (1e-2, 2e-2, 3e-2)),
        *((256, rate, 210_000) for rate in (1e-2, 2e-2)),
        (128, 1e-2, 300_000),
    ):
        yield _recipe(inputs, 0.5, batch, rate, count)
    if not quick:
        yield _recipe(inputs, 1.0, 512, 5e-3, 500_000)
        yield _recipe(inputs, 1.0, 1024, 1e-2, 250_000)


def _recipe(inputs: str, share: float, batch: int, rate: float, steps: int) -> Recipe:
    """A recipe of so many steps, up to a whole epoch."""
    blocks = (1 - Recipe().held_out) * share * SAMPLES / batch
    epochs = max(1, round(steps / blocks))
    return Recipe(inputs=inputs, sample_share=share, batch=batch, learning_rate=rate, epochs=epochs)


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--inputs", default="paper", choices=["paper", "enhanced"])
    study.add_argument("--materials", type=int, help="only the first so many")
    options = study.options()
    prevent_oversubscription()
    recipes = list(settings(options.inputs, options.quick))
    found: dict[Recipe, list[tuple[float, float]]] = {recipe: [] for recipe in recipes}
    for name, brdf in list(materials())[: options.materials]:
        gain, sampling = recipes[0].loss_gain, recipes[0].sampling
        start = time.perf_counter()
        samples = draw(brdf, SAMPLES, 0, None, options.inputs, gain, sampling)
        drawing = time.perf_counter() - start
        unseen = draw(brdf, UNSEEN, 1, None, options.inputs, gain, sampling)
        attempt(replace(recipes[0], epochs=1), samples, unseen)  # compiles the kernel
        for recipe, results in found.items():
            seconds, loss = attempt(recipe, samples, unseen)
            results.append((seconds + recipe.sample_share * drawing, loss))
        log(f"{name}: done")
    standard = np.log([loss for _, loss in found[Recipe(inputs=options.inputs)]])
    lines = []
    for recipe, results in found.items():
        relative = float(np.exp((np.log([loss for _, loss in results]) - standard).mean()))
        lines.append((statistics.median(seconds for seconds, _ in results), relative, recipe))
    named = {Recipe.preset(name, inputs=options.inputs): name for name in PRESETS}
    rows, best = [], float("inf")
    for seconds, relative, recipe in sorted(lines, key=lambda line: line[:2]):
        rows.append(
            (
                named.get(recipe, ""),
                f"{recipe.sample_share * SAMPLES:,.0f}",
                f"{recipe.batch}",
                f"{recipe.learning_rate:g}",
                f"{recipe.epochs}",
                f"{seconds:.2f}",
                f"{relative:.3f}",
                "front" if relative < best else "",
            )
        )
        best = min(best, relative)
    columns = ("preset", "samples", "batch", "rate", "epochs", "seconds", "relative loss", "")
    study.table(columns, rows)


if __name__ == "__main__":
    main()
