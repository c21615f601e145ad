"""How well held-out samples of a scan are predicted: by a network, by others of its samples.

For each scan and seed, the fit holds out a fifth of the scan's samples. The network that was
trained on the others, the interpolation of the others (`ScatteredBrdf`) and the nearest of the
others predict them. Errors are |predicted - measured| / measured, where measured is at least
0.001 1/sr, over samples and channels: the median, and the mean, which highlights dominate; and the
mean of the loss that the fit lowers, |log(1 + f cos) - log(1 + f' cos)|. Figures are means over
seeds, with the range of the median.

Run `python experiments/scattered_scans.py SCAN...` (Cornell `.brdf` or `.csv` files).
"""

from __future__ import annotations

import argparse

import numpy as np
import numpy.typing as npt

import nacre
from nacre.brdf import DirectionSamples
from nacre.measured import ScatteredBrdf
from nacre.neural.scattered import hold_out

Matrix = npt.NDArray[np.floating]

SEEDS = 3
LEAST = 1e-3
"""Measured values count as at least this much (1/sr) when errors are relative to them."""
METHODS = ("network", "interpolation", "nearest sample")


def errors(truth: DirectionSamples, values: Matrix) -> tuple[float, float, float]:
    """Median and mean relative error, and mean log-cosine error."""
    f, cosine = np.maximum(truth.rgb, 0.0), truth.cosine[:, None]
    relative = np.abs(values - f) / np.maximum(f, LEAST)
    logarithmic = np.abs(np.log1p(values * cosine) - np.log1p(f * cosine))
    return float(np.median(relative)), float(relative.mean()), float(logarithmic.mean())


def compare(scan: ScatteredBrdf, seed: int) -> list[tuple[float, float, float]]:
    """Errors of each of :data:`METHODS`."""
    recipe = nacre.Recipe(seed=seed)
    kept, held = hold_out(len(scan.samples), recipe.held_out, seed)
    part, truth = scan.subset(kept), scan.samples[held]
    nearest = part.samples.rgb[part.nearest(truth.wi, truth.wo)]
    return [
        errors(truth, nacre.fit(scan, recipe).eval(truth.wi, truth.wo)),
        errors(truth, part.eval(truth.wi, truth.wo)),
        errors(truth, np.maximum(nearest, 0.0)),
    ]


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scans", nargs="+", help="files of scattered samples")
    print("| scan | method | median error | over seeds | mean error | log-cosine |")
    print("|---|---|---|---|---|---|")
    for path in parser.parse_args().scans:
        scan = nacre.load(path)
        if not isinstance(scan, ScatteredBrdf):
            parser.error(f"{path} holds no scattered samples")
        figures = np.array([compare(scan, seed) for seed in range(SEEDS)])
        for k, method in enumerate(METHODS):
            median, mean, log_cosine = figures[:, k].mean(axis=0)
            low, high = figures[:, k, 0].min(), figures[:, k, 0].max()
            spread = f"{100 * low:.1f}–{100 * high:.1f} %"
            print(
                f"| {scan.name.split(',')[0]} | {method} | {100 * median:.1f} % | {spread} "
                f"| {100 * mean:.1f} % | {log_cosine:.4f} |"
            )


if __name__ == "__main__":
    main()
