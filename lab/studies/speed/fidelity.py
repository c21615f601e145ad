"""How close fits come to measured materials, how long they take, and the published networks.

Protocol: the deterministic sphere of :mod:`nacre.mitsuba.sphere`, 128 x 128, under an environment
map and a directional light. Sets of recipes:

- commands: what the README shows, `nacre fit` with each preset and with the paper's inputs, against
  the networks that the authors published;
- methods: inputs, sizes and lengths of training;
- presets: `nacre fit --preset`, with both kinds of inputs;
- training: the default network, the same with ReLUs, from one start, and of `--preset best`;
- stereographic: networks that see light and view as networks for textures do (Rainer, Jakob, Ghosh
  and Weyrich 2019; Figure 2 of the NBRDF paper). Of one uniform material the code is constant, and
  its part is that of the biases. The last of them has the hidden layers of 2019, 34,877 weights,
  from half the samples and a tenth of the epochs, which still take several times as long.

Seconds are medians of whole fits, one material at a time on all cores: drawing the samples,
training, and the lobes for importance sampling. `--pictures` writes a sheet of each fit. With
`--truth` the materials are others than those of the tables: published networks, or analytic models
with published parameters.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import TypeAlias

import numpy as np

import nacre
from lab.studies.study import (
    PICTURE_ERRORS,
    TABULATED,
    Study,
    data,
    log,
    museum,
    picture_errors,
    prevent_oversubscription,
    rgl_tables,
    triples,
)
from nacre.brdf import Brdf
from nacre.figures import picture
from nacre.metrics import compare
from nacre.mitsuba.preview import write_bytes
from nacre.neural.fit_data import SAMPLES
from nacre.neural.recipe import PRESETS
from nacre.numerics.mlp import RELU

_PAPER = nacre.Recipe(inputs="paper", sampling="rusinkiewicz")
COMMANDS = {
    "`nacre fit --inputs paper`": nacre.Recipe(inputs="paper"),
    **{f"`nacre fit --preset {name}`": nacre.Recipe.preset(name) for name in PRESETS},
}
METHODS = {
    "paper's inputs and directions, 675 weights": _PAPER,
    "paper's inputs, 675 weights": nacre.Recipe(inputs="paper"),
    "enhanced inputs, 675 weights": nacre.Recipe(inputs="enhanced"),
    "enhanced inputs, 675 weights, 300 epochs": nacre.Recipe(inputs="enhanced", epochs=300),
    "enhanced inputs, 298 weights, 300 epochs": nacre.Recipe(
        inputs="enhanced", hidden=(13, 12), epochs=300
    ),
    "enhanced inputs, 1,200 bytes": nacre.Recipe(inputs="enhanced", size=1200),
}
TRAINING = {
    "ReLU, one start": nacre.Recipe(activation=RELU, starts=1),
    "one start": nacre.Recipe(starts=1),
    "`standard`": nacre.Recipe(),
    "`best`": nacre.Recipe.preset("best"),
}
OUTSIDE = (
    *(("merl", name) for name in (*TABULATED[:4], "alum-bronze", "green-metallic-paint")),
    *(("rgl", f"{name}_rgb") for name in ("cc_amber_citrine", "irid_flake_paint1", "leaf_maple")),
    *(("rgl", f"{name}_rgb") for name in ("satin_purple", "vch_silk_blue", "ilm_solo_m_68")),
)
"""Published networks of materials that are not among the tables."""
PARAMETERS = (
    *("alum-bronze", "blue-metallic-paint", "cherry-235", "gold-metallic-paint", "pink-fabric"),
    "specular-black-phenolic",
)
STEREOGRAPHIC = {
    "nbrdf": _PAPER,
    "stereographic": replace(_PAPER, hidden=(22, 22), inputs="stereographic", samples=SAMPLES),
    "stereographic, 4 x 106": replace(
        _PAPER,
        hidden=(106,) * 4,
        inputs="stereographic",
        samples=SAMPLES // 2,
        epochs=10,
        learning_rate=1e-3,
    ),
}
SETS = {
    "commands": COMMANDS,
    "methods": METHODS,
    "presets": {
        f"`{name}`, {inputs} inputs": nacre.Recipe.preset(name, inputs=inputs)
        for inputs in ("paper", "enhanced")
        for name in PRESETS
    },
    "stereographic": STEREOGRAPHIC,
    "training": TRAINING,
}


_Truths: TypeAlias = Iterator[tuple[str, Brdf, Brdf | None]]


def tables() -> _Truths:
    """Name, table and published network of every RGL table."""
    for path in rgl_tables():
        yield path.stem, nacre.load(path), nacre.load(data("pretrained", "rgl", f"{path.stem}.h5"))


def networks() -> _Truths:
    """Name and published network of :data:`OUTSIDE`."""
    for folder, name in OUTSIDE:
        yield name, nacre.load(data("pretrained", folder, f"{name}.h5")), None


def parameters() -> _Truths:
    """SGD and ABC with published parameters, of some MERL materials."""
    for file in ("bagher_sgd.fit", "low_lowsmooth_E2.fit"):
        for name in PARAMETERS:
            yield f"{name} {file}", nacre.load(data("merl-fits", file), name), None


TRUTHS = {"tables": tables, "networks": networks, "parameters": parameters}


def main() -> None:
    """Print a Markdown table: means over materials and seeds, and the worst material's PSNR."""
    study = Study(__doc__, __file__)
    study.add_argument("--set", choices=SETS, default="commands", help="recipes that are compared")
    study.add_argument("--truth", choices=TRUTHS, default="tables", help="what is fitted")
    study.add_argument("--seeds", type=int, default=3, help="fits of each material")
    study.add_argument("--pictures", action="store_true", help="write a sheet of each fit")
    options = study.options()
    prevent_oversubscription()
    environment, recipes = museum(), SETS[options.set]
    errors: dict[str, list[list[list[float]]]] = {name: [] for name in ("published", *recipes)}
    seconds: dict[str, list[float]] = {name: [] for name in recipes}
    for material, truth, published in study.few(list(TRUTHS[options.truth]())):
        nacre.fit(truth, nacre.Recipe(epochs=1, samples=4000))  # compiles the kernel
        if published is not None:
            errors["published"].append([picture_errors(truth, published, environment)])
        for name, recipe in recipes.items():
            errors[name].append([])
            for seed in range(1 if options.quick else options.seeds):
                start = time.perf_counter()
                fit = nacre.fit(truth, replace(recipe, seed=options.seed + seed))
                seconds[name].append(time.perf_counter() - start)
                errors[name][-1].append(picture_errors(truth, fit, environment))
                if options.pictures and not seed:
                    drawn = picture(compare(truth, fit, environment=environment))
                    write_bytes(drawn, study.output / f"{material} {name}.png")
            log(material, name, seconds[name][-1], *errors[name][-1][-1])
    rows = []
    for name, values in errors.items():
        if not values:
            continue
        by_material = np.array([np.mean(of, axis=0) for of in values])
        cells = triples(by_material.mean(axis=0), by_material.min(axis=0))
        taken = f"{statistics.median(seconds[name]):.2f}" if name in seconds else ""
        rows.append((name, *cells, taken))
    head = "mean of all; worst PSNR", *PICTURE_ERRORS, "seconds a fit"
    study.table(head, rows, f"{options.set} {options.truth}")


if __name__ == "__main__":
    main()
