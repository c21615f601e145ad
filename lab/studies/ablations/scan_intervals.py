"""How often intervals of fits to noisy scans hold the truth.

A goniometer with small apertures (the directions of `apertures.py`) measures surfaces that are
known, with noise that the scan states: standard deviations of a part of the value and a tenth of
that part of the median value. Networks are fitted with intervals.

Columns: the median error of f_r and the median width of half its interval, relative; how much of
f_r at random pairs of directions up to 75 degrees lies in its 90 % interval; how many albedos (3
channels, 3 views) do; and the same for the 60-degree gloss (in its interval or not).

Run `python -m lab.studies.ablations.scan_intervals`.
"""

from __future__ import annotations

import numpy as np

import nacre
from lab.studies.ablations.apertures import directions
from lab.studies.study import Study, log, rgl_tables
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join
from nacre.instruments import gloss
from nacre.latent.estimates import bounds, plausible
from nacre.latent.intervals import interval
from nacre.measured import ScatteredBrdf

NOISES = 0.02, 0.05
COLUMNS = (
    *("material", "noise", "seed", "error", "half interval"),
    *("f_r inside", "albedos inside", "gloss inside"),
)


def judged(truth: Brdf, noise: float, seed: int, preset: str) -> list[float]:
    """Figures of a row."""
    wi, wo = directions()
    exact = truth.eval(wi, wo).astype(np.float64)
    sigma = noise * (exact.mean(axis=1) + 0.1 * np.median(exact))
    random = np.random.default_rng(seed)
    values = exact + sigma[:, None] * random.normal(size=(len(wi), 1))
    scan = ScatteredBrdf(wi, wo, values, truth.name, sigma=sigma)
    fitted = nacre.fit(scan, preset, seed=seed, intervals=True)
    others = plausible(fitted)
    theta, phi = np.radians(random.uniform(0.0, 75.0, (2, 4000))), random.uniform(0, np.pi, 4000)
    light, view = join(from_spherical(theta[0], 0.0 * phi)), join(from_spherical(theta[1], phi))
    low, high = bounds(fitted, light, view)
    real, found = truth.eval(light, view), fitted.eval(light, view)
    seen = np.radians([0.0, 25.0, 50.0])
    views = np.stack([np.sin(seen), 0.0 * seen, np.cos(seen)], axis=1)
    dark, bright = interval([each.albedo(views) for each in others])
    albedo = truth.albedo(views)
    dull, glossy = interval([gloss(each, 60).value for each in others])
    return [
        float(np.median(np.abs(found / np.maximum(real, 1e-9) - 1.0))),
        float(np.median(0.5 * np.log(high / np.maximum(low, 1e-9)))),
        float(((low <= real) & (real <= high)).mean()),
        float(((dark <= albedo) & (albedo <= bright)).mean()),
        float(dull <= gloss(truth, 60).value <= glossy),
    ]


def main() -> None:
    """Print one table."""
    study = Study(__doc__, __file__)
    study.add_argument("--seeds", type=int, default=2, help="noises and fits each")
    study.add_argument("--preset", default="standard", help="of the fits")
    options = study.options()
    paint = {"diffuse": (0.1, 0.12, 0.2), "specular": (0.05, 0.05, 0.05), "roughness": 0.1}
    materials: list[Brdf] = [MODELS["ggx"](**paint, name="GGX, 0.1")]
    materials += [nacre.load(path) for path in study.few(rgl_tables(), 1)]
    rows, figures = [], []
    for truth in materials:
        for noise in NOISES:
            for seed in range(options.seeds):
                row = judged(truth, noise, seed, options.preset)
                figures.append(row)
                rows.append(_row(truth.name, f"{noise:.0%}", str(seed), row))
                log(*rows[-1])
    rows.append(_row("mean", "", "", list(np.mean(figures, axis=0))))
    study.table(COLUMNS, rows)


def _row(name: str, noise: str, seed: str, row: list[float]) -> tuple[str, ...]:
    error, half, *inside = row
    shown = (f"{error:.1%}", f"{half:.1%}", *(f"{part:.0%}" for part in inside))
    return (name, noise, seed, *shown)


if __name__ == "__main__":
    main()
