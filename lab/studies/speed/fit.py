"""Fit time and loss per material, against the paper's training loop on the same cores.

Both train on the same samples, one material per core at a time, and take turns of a few epochs, so
that a change of the machine's speed meets both: real RGL tables, and published networks of MERL
materials as tables. The held-out loss of the paper's loop counts as reached by the whole training
of `--preset draft`, on its own fewer samples, or else of `standard`, whichever first ends below it.
`python -m lab.studies.speed.fit --help`.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np

from lab.studies.speed.peak import peak
from lab.studies.study import Study, log, materials, prevent_oversubscription
from nacre import Brdf
from nacre.neural.fit_data import SAMPLES
from nacre.neural.kernel import KernelTrainer
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK, Samples, draw
from nacre.neural.training import epochs as run_epochs
from nacre.neural.training import initial_layers, train
from nacre.runtime.parallel import core_count

SAMPLING = "mixed"
MULTIPLY_ADDS = 2 * (6 * 21 + 21 * 21 + 21 * 3) + 21 * 21 + 21 * 3
"""Of a training sample: forward, gradients of the weights, and of the activations."""


def rows_of(samples: Samples) -> np.ndarray:
    """Samples as one row each: inputs, log(1 + f cos), cosine."""
    shaped = samples.blocks.reshape(-1, samples.rows, BLOCK)
    rows = np.ascontiguousarray(shaped.transpose(0, 2, 1).reshape(-1, samples.rows))
    rows[:, -4:-1] = np.log1p(rows[:, -4:-1])
    return rows


class Reference:
    """The paper's loop on one material, in a process of its own."""

    def __init__(self, training: Samples, held_out: Samples, folder: Path) -> None:
        np.savez(folder / "samples.npz", training=rows_of(training), held_out=rows_of(held_out))
        self._process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "lab.studies.references.paper_loop",
                str(folder / "samples.npz"),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def begin(self, epochs: int) -> None:
        """Start to train."""
        assert self._process.stdin
        self._process.stdin.write(f"{epochs}\n")
        self._process.stdin.flush()

    def end(self) -> tuple[float, float]:
        """Seconds of what was begun, and the held-out loss after it."""
        assert self._process.stdout
        answer = json.loads(self._process.stdout.readline())
        return answer["seconds"], answer["held_out_loss"]

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


class Kernel:
    """Our standard recipe, with the paper's inputs, on one material."""

    def __init__(self, training: Samples, held_out: Samples, epochs: int) -> None:
        recipe = Recipe(inputs="paper", epochs=epochs)
        self._trainer = KernelTrainer(initial_layers(recipe.hidden, recipe.seed), recipe.batch)
        self._held_out = held_out
        self._epochs = run_epochs(self._trainer, training, recipe)

    def run(self, epochs: int) -> tuple[float, float]:
        """Seconds of so many more epochs, and the core's multiply-adds a second before them."""
        rate = peak()
        start = time.perf_counter()
        for _ in islice(self._epochs, epochs):
            pass
        return time.perf_counter() - start, rate

    def loss(self) -> float:
        """Held-out loss."""
        return self._trainer.loss(self._held_out)


@dataclass
class Result:
    """What came of one material: seconds an epoch of every turn, losses, the draft's seconds."""

    name: str
    reference: list[float] = field(default_factory=list)
    kernel: list[float] = field(default_factory=list)
    peak: list[float] = field(default_factory=list)
    reference_loss: float = 0.0
    loss: float = 0.0
    draft_loss: float = 0.0
    draft_seconds: float = 0.0

    @property
    def ratio(self) -> float:
        """How much faster an epoch is: median over the turns."""
        return statistics.median(a / b for a, b in zip(self.reference, self.kernel, strict=True))

    def fraction(self, samples: int) -> float:
        """Fraction of the core's peak rate of multiply-adds: median over the turns."""
        pairs = zip(self.kernel, self.peak, strict=True)
        return statistics.median(samples * MULTIPLY_ADDS / s / p for s, p in pairs)

    def sooner(self, epochs: int) -> tuple[float, str]:
        """How much sooner the loss of so many epochs of the reference was reached, and by what."""
        if self.draft_loss <= self.reference_loss:
            return epochs * statistics.median(self.reference) / self.draft_seconds, "draft"
        return (self.ratio, "standard") if self.loss <= self.reference_loss else (0.0, "nothing")


def attempt(recipe: Recipe, samples: Samples, held_out: Samples) -> tuple[float, float]:
    """Seconds of a training on the recipe's fraction of the samples, and its held-out loss."""
    count = round((1 - recipe.held_out) * recipe.sample_share * SAMPLES) // BLOCK
    few = Samples(samples.blocks[: count * samples.rows * BLOCK], samples.inputs)
    layers = initial_layers(recipe.hidden, recipe.seed, samples.inputs)
    trainer = KernelTrainer(layers, recipe.batch)
    start = time.perf_counter()
    quality = train(trainer, few, held_out, recipe)
    return time.perf_counter() - start, quality["held_out_loss"]


def draft(part: tuple[Samples, Samples]) -> tuple[float, float]:
    """Seconds and held-out loss of the training of a draft."""
    return attempt(Recipe.preset("draft", inputs="paper"), *part)


def measure(group: Sequence[tuple[str, Brdf]], options: argparse.Namespace) -> list[Result]:
    """Materials, one a core."""
    recipe = Recipe(inputs="paper")
    parts = []
    for _, brdf in group:
        samples = draw(brdf, SAMPLES, recipe.seed, distribution=SAMPLING)
        parts.append(samples.split(recipe.held_out))
    results = [Result(name) for name, _ in group]
    turn = options.epochs // options.turns
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(len(group)) as pool:
        folders = [Path(name, str(index)) for index in range(len(group))]
        for folder in folders:
            folder.mkdir()
        references = [Reference(*p, folder) for p, folder in zip(parts, folders, strict=True)]
        kernels = [Kernel(*part, options.epochs) for part in parts]
        for _ in range(options.turns):
            for reference in references:
                reference.begin(turn)
            for result, reference in zip(results, references, strict=True):
                seconds, result.reference_loss = reference.end()
                result.reference.append(seconds / turn)
            turns = pool.map(lambda kernel: kernel.run(turn), kernels)
            for result, (seconds, rate) in zip(results, turns, strict=True):
                result.kernel.append(seconds / turn)
                result.peak.append(rate)
        for reference in references:
            reference.close()
        for result, kernel, found in zip(results, kernels, pool.map(draft, parts), strict=True):
            result.loss = kernel.loss()
            result.draft_seconds, result.draft_loss = found
    return results


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--epochs", type=int, default=100)
    study.add_argument("--turns", type=int, default=10)
    study.add_argument("--materials", type=int, help="only the first so many")
    options = study.options()
    if options.epochs % options.turns:
        study.error("--epochs must be a multiple of --turns")
    prevent_oversubscription()
    cores, results = core_count(), []
    chosen = list(study.few(list(materials())[: options.materials]))
    draft(draw(chosen[0][1], 20_000, 0).split(0.2))  # compiles the kernel
    for first in range(0, len(chosen), cores):
        # An odd one out is joined by copies, so that every core is always busy.
        group = chosen[first : first + cores]
        found = measure((group * cores)[:cores], options)[: len(group)]
        results += found
        for result in found:
            log(result)
    count = round((1 - Recipe().held_out) * SAMPLES)
    rows = [
        (
            r.name,
            f"{statistics.median(r.reference):.3f}",
            f"{statistics.median(r.kernel):.4f}",
            f"{r.ratio:.1f}x",
            f"{100 * r.fraction(count):.0f} %",
            f"{r.reference_loss:.5f}",
            f"{r.loss:.5f}",
            f"{r.draft_loss:.5f}",
            "{:.0f}x, {}".format(*r.sooner(options.epochs)),
        )
        for r in results
    ]
    columns = (
        "material",
        "reference, s an epoch",
        "nacre, s an epoch",
        "faster",
        "of peak",
        f"reference, loss after {options.epochs} epochs",
        "nacre, loss",
        "draft, loss",
        "reference's loss sooner, by",
    )
    medians = (
        f"{statistics.median(r.ratio for r in results):.1f}x faster, "
        f"{100 * statistics.median(r.fraction(count) for r in results):.0f} % of the peak, "
        f"{statistics.median(r.sooner(options.epochs)[0] for r in results):.0f}x sooner"
    )
    epoch = f"An epoch is {count:,} samples on one core while all {cores} cores do the same."
    study.table(columns, rows, note=f"Medians: {medians}. {epoch}")


if __name__ == "__main__":
    main()
