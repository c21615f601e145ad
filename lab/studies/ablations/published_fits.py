"""Published parameters of analytic models against published networks of the same materials.

For each table of parameters (`.fit`) and each material of which there is a network (`.h5`), both
are evaluated at directions uniform in the Rusinkiewicz angles, at least 10 degrees above the
horizon. Their log-correlation is Pearson's of log(f + 0.001) over samples and channels; their
ratio is the median of the table's f over the network's. Printed is, for each table, the median of
both over materials, and the material with the lowest correlation.

Run `python -m lab.studies.ablations.published_fits`.
"""

from __future__ import annotations

import numpy as np

import nacre
from lab.studies.study import Study, data
from nacre.analytic import tables
from nacre.errors import FormatError
from nacre.geometry import join, uniform_rusinkiewicz

SAMPLES = 20_000
FLOOR = 1e-3
LOWEST = np.sin(np.radians(10.0))


def main() -> None:
    """Print one table."""
    study = Study(__doc__, __file__)
    study.options()
    u = np.random.default_rng(0).random((4, SAMPLES))
    u[1] = 0.0
    wi, wo = (join(w) for w in uniform_rusinkiewicz(u))
    kept = (wi[:, 2] > LOWEST) & (wo[:, 2] > LOWEST)
    wi, wo = wi[kept], wo[kept]
    networks = {p.stem: nacre.load(p).eval(wi, wo) for p in data("pretrained", "merl").glob("*.h5")}
    rows = []
    for path in sorted(data("merl-fits").glob("*.fit")):
        figures: dict[str, tuple[float, float]] = {}
        try:
            for name in sorted(set(tables.materials(path)) & set(networks)):
                ours, theirs = nacre.load(path, name).eval(wi, wo), networks[name]
                logs = np.log(ours.ravel() + FLOOR), np.log(theirs.ravel() + FLOOR)
                ratio = np.median((ours + FLOOR) / (theirs + FLOOR))
                figures[name] = float(np.corrcoef(*logs)[0, 1]), float(ratio)
        except FormatError as error:
            rows.append((path.stem, "", "", "", str(error)))
            continue
        correlation, ratio = np.median(list(figures.values()), axis=0)
        worst = min(figures, key=lambda name: figures[name][0])
        lowest = f"{worst} {figures[worst][0]:.3f}"
        rows.append((path.stem, str(len(figures)), f"{correlation:.3f}", f"{ratio:.2f}", lowest))
    study.table(("table", "materials", "log-correlation", "ratio", "lowest correlation"), rows)


if __name__ == "__main__":
    main()
