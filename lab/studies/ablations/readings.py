"""Materials from readings of instruments, beside as many random samples of f_r.

The materials are the measured RGL tables of the test data, which the included basis has not seen:
the networks published of them were left out of its training (:mod:`.shipped_codes`). What
instruments read of each is simulated from the table, with noise of the default uncertainties; then
come as many samples of f_r at random pairs of directions, with noise of 2 %.

- the median error of f_r at random pairs, as a factor, and MAE of a sphere under the museum;
- how often intervals of 90 % hold the truth: of f_r at these pairs, of the albedo along the normal,
  and of readings that were not taken.

With `--networks`, the materials are published networks of a seeded fifth that a basis trained for
this leaves out: that is what the precision of readings and the intervals were chosen on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import nacre
from lab.studies.ablations.few_samples import DRAWS, PAIRS, random_pairs
from lab.studies.ablations.shipped_codes import networks
from lab.studies.study import Study, log, museum, picture_errors, progress, rgl_tables
from nacre.brdf import Brdf
from nacre.instruments import E2194
from nacre.instruments.quantities import (
    FortyFiveQuantity,
    GlossQuantity,
    HazeQuantity,
    MultiangleQuantity,
    Quantity,
    SphereQuantity,
)
from nacre.instruments.readings import Reading, known_quantities
from nacre.latent import NeuralBasis, pretrained_basis
from nacre.latent.estimates import albedo_interval
from nacre.latent.intervals import reflectance_interval
from nacre.latent.posterior import Posterior
from nacre.measuring.from_readings import posterior_of_readings
from nacre.measuring.predictions import predict
from nacre.metrics import albedo
from nacre.numerics.direction_samples import DirectionSamples
from nacre_lab.reproduce.codes import CodeSettings, bases, split

_GLOSS = [GlossQuantity(angle) for angle in (20.0, 60.0, 85.0)]
_SPHERE = [SphereQuantity("di:8"), SphereQuantity("de:8")]
SETS: dict[str, Sequence[Quantity]] = {
    "gloss at 60°, d:8": [GlossQuantity(60.0), SphereQuantity("di:8")],
    "gloss at 3 angles, 45a:0": [*_GLOSS, FortyFiveQuantity("45a:0")],
    "gloss at 3 angles, haze, 6 angles, d:8 and de:8": [
        *(*_GLOSS, HazeQuantity()),
        *(*map(MultiangleQuantity, E2194), *_SPHERE),
    ],
}
"""Readings that shops take, by name."""
NOISE = 0.02
"""Relative standard deviation of samples."""
SMALLEST = 1e-3
"""f_r in 1/sr from which errors are counted."""

Row = tuple[float, ...]


def noisy(truth: Brdf, quantities: Sequence[Quantity], seed: int) -> list[Reading]:
    """Readings with the noise that they are said to have."""
    random = np.random.default_rng((seed, 17))
    found = []
    for quantity in quantities:
        exact = Reading.of(truth, quantity)
        off = exact.uncertainty * random.normal(size=len(exact.values))
        values = tuple((np.asarray(exact.values) + off).tolist())
        found.append(Reading(quantity, values, exact.uncertainty))
    return found


def samples_of(truth: Brdf, count: int, seed: int) -> DirectionSamples:
    """Samples at random pairs, with noise."""
    wi, wo = random_pairs(count, seed)
    f_r = truth.eval(wi, wo)
    sigma = NOISE * f_r.mean(axis=1)
    off = sigma[:, None] * np.random.default_rng((seed, 18)).normal(size=f_r.shape)
    return DirectionSamples(wi, wo, np.maximum(f_r + off, 0.0).astype(np.float32), sigma)


def judged(
    basis: NeuralBasis,
    truth: Brdf,
    found: Posterior,
    others: Sequence[Quantity],
) -> Row:
    """Errors of f_r and of pictures, and fractions inside of intervals; see the module."""
    codes = found.draw(DRAWS)
    materials = [basis.decode(code) for code in codes]
    middle = basis.decode(found.code)
    pairs = random_pairs(PAIRS, 1)
    f_r = truth.eval(*pairs).astype(np.float64)
    lit = f_r > SMALLEST
    factor = np.abs(np.log(np.maximum(middle.eval(*pairs), 1e-9)[lit] / f_r[lit]))
    low, high = reflectance_interval(materials, *pairs)
    darkest, brightest = albedo_interval(materials)
    own = albedo(truth, 0.0).value
    inside = []
    for quantity in others:
        expected = predict(basis, found.code, codes, quantity)
        values = np.asarray(quantity.read(truth))
        inside.append(((values >= expected.low) & (values <= expected.high)).mean())
    return (
        float(np.median(factor)),
        picture_errors(truth, middle, museum(), size=64, directions=96)[0],
        float(((f_r >= low) & (f_r <= high)).mean()),
        float(((own >= darkest) & (own <= brightest)).mean()),
        float(np.mean(inside)),
    )


def cells(rows: Sequence[Row]) -> list[str]:
    """Means over materials."""
    factor, error, *inside = np.mean(rows, axis=0)
    return [f"{np.exp(factor) - 1.0:.1%}", f"{error:.4f}", *(f"{part:.0%}" for part in inside)]


def main() -> None:
    """Print the tables."""
    study = Study(__doc__, __file__)
    study.add_argument("--networks", action="store_true", help="held-out published networks")
    options = study.options()
    if options.networks:
        training, paths = split(networks(), options.seed)
        settings = CodeSettings(seed=options.seed)
        settings = settings.quick() if options.quick else settings
        basis = bases(training, ["neural"], settings, study.cache, progress)["neural"]
    else:
        basis, paths = pretrained_basis(), rgl_tables()
    assert isinstance(basis, NeuralBasis)
    tables, summary = [], []
    materials = [nacre.load(path) for path in study.few(paths)]
    for name, quantities in SETS.items():
        others = [quantity for quantity in known_quantities() if quantity not in quantities]
        of_readings, of_samples = [], []
        for index, truth in enumerate(materials):
            seed = 100 * options.seed + index
            found = posterior_of_readings(basis, noisy(truth, quantities, seed))
            of_readings.append(judged(basis, truth, found, others))
            count = len(quantities)
            sampled = basis.posterior(samples_of(truth, count, seed))
            of_samples.append(judged(basis, truth, sampled, others))
            both = [f"{x:.4f}" for x in (*of_readings[-1], *of_samples[-1])]
            log(count, truth.name, *both)
            own = of_readings[-1], of_samples[-1]
            tables.append((str(count), truth.name, *(cell for row in own for cell in cells([row]))))
        summary.append((f"{len(quantities)}: {name}", *cells(of_readings)))
        summary.append((f"{len(quantities)} random samples", *cells(of_samples)))
    columns = "f_r", "MAE", "f_r inside", "albedo", "readings"
    part = f"{'networks ' if options.networks else ''}seed {options.seed}"
    study.table(("known from", *columns), summary, part)
    each = "readings", "samples"
    both = tuple(f"{kind}: {column}" for kind in each for column in columns)
    study.table(("count", "material", *both), tables, f"{part} materials")


if __name__ == "__main__":
    main()
