"""Fit time and loss per material, against the paper's training loop on the same cores.

Both train on the same samples of each real RGL table, one material per core at a time, and take
turns, so that a change of the machine's speed meets both. `python -m benchmarks.fit --help`.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks.table import markdown, prevent_oversubscription
from nacre import load
from nacre.neural.kernel import KernelTrainer
from nacre.neural.prepared import SAMPLES
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK, Samples, draw
from nacre.neural.training import initial_layers, train
from nacre.parallel import core_count
from tests.data import list_data, require_data


def rows_of(samples: Samples) -> np.ndarray:
    """Samples as one row each: inputs, log(1 + f cos), cosine."""
    shaped = samples.blocks.reshape(-1, samples.rows, BLOCK)
    rows = np.ascontiguousarray(shaped.transpose(0, 2, 1).reshape(-1, samples.rows))
    rows[:, -4:-1] = np.log1p(rows[:, -4:-1])
    return rows


def run_reference(parts: list[tuple[Samples, Samples]], epochs: int) -> list[dict[str, float]]:
    """The reference loop on several materials, a process each."""
    with tempfile.TemporaryDirectory() as folder:
        processes = []
        for index, (training, held_out) in enumerate(parts):
            source, target = Path(folder, f"{index}.npz"), Path(folder, f"{index}.json")
            np.savez(source, training=rows_of(training), held_out=rows_of(held_out))
            command = [sys.executable, "-m", "benchmarks.reference", source, str(epochs), target]
            processes.append((subprocess.Popen([str(c) for c in command]), target))
        for process, _ in processes:
            if process.wait():
                sys.exit("the reference loop failed")
        return [json.loads(target.read_text()) for _, target in processes]


def run_kernel(parts: list[tuple[Samples, Samples]], recipe: Recipe) -> list[dict[str, float]]:
    """Our recipe on several materials, a thread each."""

    def one(part: tuple[Samples, Samples]) -> dict[str, float]:
        trainer = KernelTrainer(initial_layers(recipe.hidden, recipe.seed), recipe.batch)
        start = time.perf_counter()
        quality = train(trainer, *part, recipe)
        return {"seconds": time.perf_counter() - start, "loss": quality["held_out_loss"]}

    with ThreadPoolExecutor(len(parts)) as pool:
        return list(pool.map(one, parts))


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--epochs", type=int, default=100)
    parser.add_argument(
        "--reference-epochs",
        type=int,
        help="fewer, to time without waiting for losses (default: as many)",
    )
    options = parser.parse_args()
    prevent_oversubscription()
    recipe = Recipe(epochs=options.epochs)
    reference_epochs = options.reference_epochs or options.epochs
    names = list_data("rgl", "*.bsdf")
    if not names:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    parts = {}
    for name in names:
        start = time.perf_counter()
        samples = draw(load(require_data("rgl", name)), SAMPLES, recipe.seed)
        parts[name] = samples.split(recipe.held_out)
        print(f"{name}: samples drawn in {time.perf_counter() - start:.2f} s", file=sys.stderr)
    warm_up = parts[names[0]][1].split(0.01)[1]
    run_kernel([(warm_up, warm_up)], Recipe(epochs=1))

    cores, rows, ratios = core_count(), [], []
    for first in range(0, len(names), cores):
        # An odd one out is joined by copies, so that every core is always busy.
        group = (names[first : first + cores] * cores)[:cores]
        group_parts = [parts[name] for name in group]
        theirs = run_reference(group_parts, reference_epochs)
        ours = run_kernel(group_parts, recipe)
        for name, reference, kernel in dict(
            zip(group, zip(group, theirs, ours, strict=True), strict=True)
        ).values():
            slow = reference["seconds"] / reference_epochs
            fast = kernel["seconds"] / recipe.epochs
            ratios.append(slow / fast)
            rows.append(
                (
                    name.removesuffix(".bsdf"),
                    f"{slow / cores:.3f}",
                    f"{fast / cores:.4f}",
                    f"{slow / fast:.1f}x",
                    f"{kernel['seconds']:.2f}",
                    f"{reference['held_out_loss']:.5f}",
                    f"{kernel['loss']:.5f}",
                )
            )
            print(*rows[-1], file=sys.stderr, flush=True)
    columns = (
        "material",
        "reference, s an epoch",
        "nacre, s an epoch",
        "faster",
        f"nacre, s for {recipe.epochs} epochs on one core",
        "reference, held-out loss",
        "nacre, held-out loss",
    )
    print(markdown(columns, rows))
    print(f"\nMedian {statistics.median(ratios):.1f}x. An epoch is {0.8 * SAMPLES:,.0f} samples;")
    print(f"its seconds are those of {cores} cores that work on {cores} materials, per material.")


if __name__ == "__main__":
    main()
