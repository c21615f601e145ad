"""How well held-out samples of a scan are predicted, and how high a fit rises at the horizon.

For each scan and seed, a fifth of the scan's samples is held out (random splits, drawn again for
each seed). Networks of two inputs and precisions, and a GGX with a diffuse base, fitted to the
others, the interpolation of the others (`ScatteredBrdf`) and the nearest of the others predict
them. Errors are |predicted -
measured| / measured, where measured is at least 0.001 1/sr, over samples and channels: the median,
its range over seeds, and the mean, which highlights dominate.

Over a sweep of directions up to 89.9 degrees, dense about the mirror direction: `highest` is the
highest f_r relative to the highest of the samples trained on, in the worst channel and seed;
`grazing` is the 99th percentile, over pairs with a direction beyond 80 degrees, of (f + 0.01) /
(g + 0.01), g the interpolation: 1 is as high as that, in the worst seed.

Run `python -m lab.studies.ablations.scattered_scans SCAN...` (Cornell `.brdf` or `.csv` files).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.study import Study
from nacre import analytic
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join
from nacre.measured import ScatteredBrdf
from nacre.neural.scattered import WEIGHT, hold_out, relative_errors

Matrix = npt.NDArray[np.floating]

SEEDS = 3
NETWORKS = {
    f"network {'-'.join(map(str, hidden))}, {inputs}, {precision}": nacre.Recipe(
        hidden=hidden, inputs=inputs, precision=precision
    )
    for hidden in ((21, 21), (21, 21, 21))
    for inputs in ("paper", "enhanced")
    for precision in ("single", "half")
}
METHODS = (
    *NETWORKS,
    "interpolation",
    "nearest sample",
    "GGX and diffuse",
)


class Nearest(Brdf):
    """The value of the nearest sample."""

    def __init__(self, scan: ScatteredBrdf) -> None:
        self.scan = scan

    def eval_components(self, wi, wo):  # type: ignore[no-untyped-def]
        """See :class:`nacre.brdf.Brdf`."""
        nearest = self.scan.nearest(join(wi), join(wo))
        return tuple(self.scan.samples.rgb[nearest].T)


def sweep(count: int = 40_000) -> tuple[Matrix, Matrix]:
    """Pairs at all polar angles, then near the mirror direction; a third of them grazing."""
    random = np.random.default_rng(0)
    theta = np.radians(random.uniform(0.0, 89.9, (2, count)))
    theta[:, ::3] = np.radians(random.uniform(80.0, 89.9, theta[:, ::3].shape))
    theta[:, ::9] = np.radians(89.9)
    phi = random.uniform(0.0, np.pi, count)
    wi = join(from_spherical(theta[0], np.zeros(count)))
    wo = join(from_spherical(theta[1], phi))
    offset = np.exp(random.uniform(np.log(1e-3), np.log(0.3), (count, 1)))
    mirror = wi * [-1.0, -1.0, 1.0] + offset * random.normal(size=(count, 3))
    mirror[:, 2] = np.maximum(mirror[:, 2], np.cos(np.radians(89.9)))
    mirror /= np.linalg.norm(mirror, axis=1, keepdims=True)
    return np.tile(wi, (2, 1)), np.concatenate([wo, mirror])


def compare(scan: ScatteredBrdf, seed: int) -> list[tuple[float, float, float, float]]:
    """Median and mean error, `highest` and `grazing` of each of :data:`METHODS`."""
    kept, held = hold_out(len(scan.samples), nacre.Recipe().held_out, seed)
    part, truth = scan.subset(kept), scan.samples[held]
    fitted: list[Brdf] = [
        *(nacre.fit(scan, replace(recipe, seed=seed)) for recipe in NETWORKS.values()),
        part,
        Nearest(part),
        analytic.fit(part, analytic.MODELS["ggx"], gain=WEIGHT, seed=seed),
    ]
    wi, wo = sweep()
    grazing = np.minimum(wi[:, 2], wo[:, 2]) < np.cos(np.radians(80.0))
    usual = part.eval(wi[grazing], wo[grazing])
    figures = []
    for brdf in fitted:
        values = brdf.eval(wi, wo)
        figures.append(
            (
                *relative_errors(brdf.eval(truth.wi, truth.wo), truth.rgb),
                float((values / part.samples.rgb.max(axis=0)).max()),
                float(np.quantile((values[grazing] + 0.01) / (usual + 0.01), 0.99)),
            )
        )
    return figures


def main() -> None:
    """Print one table."""
    study = Study(__doc__, __file__)
    study.add_argument("scans", nargs="+", help="files of scattered samples")
    rows = []
    for path in study.options().scans:
        scan = nacre.load(path)
        if not isinstance(scan, ScatteredBrdf):
            study.error(f"{path} holds no scattered samples")
        figures = np.array([compare(scan, seed) for seed in range(SEEDS)])
        for k, method in enumerate(METHODS):
            median, mean = 100 * figures[:, k, :2].mean(axis=0)
            low, high = 100 * figures[:, k, 0].min(), 100 * figures[:, k, 0].max()
            highest, grazing = figures[:, k, 2:].max(axis=0)
            numbers = (f"{median:.1f} %", f"{low:.1f} to {high:.1f} %", f"{mean:.1f} %")
            name = f"{scan.name.split(',')[0]}, {method}"
            rows.append((name, *numbers, f"{highest:.2f}", f"{grazing:.2f}"))
    columns = "scan, method", "median error", "over seeds", "mean error", "highest", "grazing"
    study.table(columns, rows)


if __name__ == "__main__":
    main()
