"""Published parameters of analytic models against published networks of the same materials.

For each table of parameters (`.fit`) and each material of which there is a network (`.h5`), both
are evaluated at directions uniform in the Rusinkiewicz angles, at least 10 degrees above the
horizon. Their log-correlation is Pearson's of log(f + 0.001) over samples and channels; their
ratio is the median of the table's f over the network's. Printed is, for each table, the median of
both over materials, and the material with the lowest correlation.

Run `python -m studies.ablations.published_fits FITS NETWORKS`, two folders.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import nacre
from nacre.analytic import tables
from nacre.errors import FormatError
from nacre.geometry import join, uniform_rusinkiewicz

SAMPLES = 20_000
FLOOR = 1e-3
LOWEST = np.sin(np.radians(10.0))


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("fits", type=Path, help="folder of .fit files")
    parser.add_argument("networks", type=Path, help="folder of .h5 files")
    options = parser.parse_args()
    u = np.random.default_rng(0).random((4, SAMPLES))
    u[1] = 0.0
    wi, wo = (join(w) for w in uniform_rusinkiewicz(u))
    kept = (wi[:, 2] > LOWEST) & (wo[:, 2] > LOWEST)
    wi, wo = wi[kept], wo[kept]
    networks = {p.stem: nacre.load(p).eval(wi, wo) for p in options.networks.glob("*.h5")}
    print("| table | materials | log-correlation | ratio | lowest correlation |")
    print("|---|---:|---:|---:|---|")
    for path in sorted(options.fits.glob("*.fit")):
        figures: dict[str, tuple[float, float]] = {}
        try:
            for name in sorted(set(tables.materials(path)) & set(networks)):
                ours, theirs = nacre.load(path, name).eval(wi, wo), networks[name]
                logs = np.log(ours.ravel() + FLOOR), np.log(theirs.ravel() + FLOOR)
                ratio = np.median((ours + FLOOR) / (theirs + FLOOR))
                figures[name] = float(np.corrcoef(*logs)[0, 1]), float(ratio)
        except FormatError as error:
            print(f"| {path.stem} | | | | {error} |")
            continue
        correlation, ratio = np.median(list(figures.values()), axis=0)
        worst = min(figures, key=lambda name: figures[name][0])
        print(
            f"| {path.stem} | {len(figures)} | {correlation:.3f} | {ratio:.2f} "
            f"| {worst} {figures[worst][0]:.3f} |"
        )


if __name__ == "__main__":
    main()
