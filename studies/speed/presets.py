"""Time and quality of the presets of `nacre fit` on the real RGL tables.

Seconds are medians of whole fits, one material at a time on all cores: drawing the samples,
training, and the lobes for importance sampling. Pictures are those of
:mod:`studies.speed.fidelity`. `python -m studies.speed.presets --help`.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time

import numpy as np

import nacre
from nacre.neural.recipe import PRESETS
from nacre.render.environment import load_environment
from studies.speed.fidelity import figures
from studies.speed.table import markdown, prevent_oversubscription
from tests.data import data_folder


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1, help="fits of each material")
    parser.add_argument("--materials", type=int, help="only the first so many")
    options = parser.parse_args()
    data = data_folder()
    if data is None:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    prevent_oversubscription()
    environment = load_environment(data / "environment" / "museum.exr")
    seconds: dict[tuple[str, str], list[float]] = {}
    values: dict[tuple[str, str], list[list[float]]] = {}
    for path in sorted((data / "rgl").glob("*.bsdf"))[: options.materials]:
        truth = nacre.load(path)
        nacre.fit(truth, nacre.Recipe(epochs=1, samples=4000))  # compiles the kernel
        for inputs in ("paper", "enhanced"):
            for name in PRESETS:
                key = (name, inputs)
                for seed in range(options.seeds):
                    recipe = nacre.Recipe.preset(name, inputs=inputs, seed=seed)
                    start = time.perf_counter()
                    network = nacre.fit(truth, recipe)
                    seconds.setdefault(key, []).append(time.perf_counter() - start)
                    found = figures(truth, network, environment)
                    values.setdefault(key, []).append(found)
                print(path.stem, *key, seconds[key][-1], *found, file=sys.stderr, flush=True)
    rows = []
    for (name, inputs), times in seconds.items():
        mean = np.mean(values[name, inputs], axis=0)
        lights = (f"{m:.4f} / {s:.4f} / {p:.1f}" for m, s, p in (mean[:3], mean[3:]))
        rows.append((f"`{name}`, {inputs} inputs", f"{statistics.median(times):.2f}", *lights))
    head = ("preset", "seconds", "environment: MAE / SSIM / PSNR", "directional: MAE / SSIM / PSNR")
    print(markdown(head, rows))


if __name__ == "__main__":
    main()
