"""Seconds per material and epoch of stacks of materials on a device, beside the CPU kernel.

Stacks of several sizes and the kernel take turns on the samples of the real RGL tables, over and
over where a stack has more materials than there are tables. On a CUDA card a stack is trained in
two ways: an epoch per launch, and by a recorded step of PyTorch. `python -m
lab.studies.speed.stacked --help`; for a card `--device cuda --stacks 1 8 32 128`.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from lab.studies.study import Study, log, rgl_tables
from nacre import load
from nacre.errors import require
from nacre.neural.fit_data import SAMPLES
from nacre.neural.kernel import KernelTrainer
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK, Samples, draw
from nacre.neural.torch import SampleStack, TorchTrainer
from nacre.neural.torch_steps import StepsTrainer
from nacre.neural.training import initial_layers, schedule
from nacre.runtime.parallel import core_count

RECIPE = Recipe(inputs="paper")

Epoch = Callable[[np.ndarray, np.ndarray], object]
"""Called with an order of blocks and learning rates."""


def kernel_epoch(samples: list[Samples], cores: int) -> Epoch:
    """An epoch of one material a core on the compiled kernel."""
    layers = initial_layers(RECIPE.hidden, RECIPE.seed, samples[0].inputs)
    pairs = [(KernelTrainer(layers, RECIPE.batch), samples[k % len(samples)]) for k in range(cores)]
    pool = ThreadPoolExecutor(cores)
    return lambda order, rates: list(
        pool.map(lambda pair: pair[0].epoch(pair[1], order, rates), pairs)
    )


def stack_epoch(
    samples: list[Samples], materials: int, device: str, kind: type[TorchTrainer]
) -> Epoch:
    """An epoch of a stack of materials on a device, until the device is done."""
    torch = require("torch", "latent")
    layers = initial_layers(RECIPE.hidden, RECIPE.seed, samples[0].inputs)
    trainer = kind(layers, RECIPE.batch, device, materials)
    stack = SampleStack([samples[k % len(samples)] for k in range(materials)], device)

    def epoch(order: np.ndarray, rates: np.ndarray) -> None:
        trainer.epoch(stack, order, rates)
        if torch.device(device).type == "cuda":
            torch.cuda.synchronize(device)

    return epoch


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--device", default="cpu", help="PyTorch device (default: %(default)s)")
    study.add_argument("--stacks", type=int, nargs="+", default=[1, 8, 32, 100])
    study.add_argument("--samples", type=int, default=SAMPLES, help="of a material")
    study.add_argument("--rounds", type=int, default=3, help="epochs of each that are timed")
    options = study.options()
    torch, cores = require("torch", "latent"), core_count()
    torch.set_num_threads(cores)
    samples = []
    for path in rgl_tables()[: max(*options.stacks, cores)]:
        drawn = draw(load(path), options.samples, RECIPE.seed)
        samples.append(drawn.split(RECIPE.held_out)[0])
        log(f"{path.stem}: samples drawn")
    blocks = samples[0].block_count
    random = np.random.default_rng(RECIPE.seed)
    rates = schedule(-(-blocks * BLOCK // RECIPE.batch), RECIPE.learning_rate)

    ways: dict[str, type[TorchTrainer]] = {"a launch per step": TorchTrainer}
    if torch.device(options.device).type == "cuda":
        ways["a launch per epoch"] = StepsTrainer
    subjects = {("kernel, a material a core", cores): kernel_epoch(samples, cores)}
    subjects |= {
        (f"stack of {m} on {options.device}, {way}", m): stack_epoch(
            samples, m, options.device, kind
        )
        for way, kind in ways.items()
        for m in options.stacks
    }
    seconds: dict[str, list[float]] = {name: [] for name, _ in subjects}
    for round_ in range(options.rounds + 1):
        order = random.permutation(blocks)
        for (name, materials), epoch in subjects.items():
            start = time.perf_counter()
            epoch(order, rates)
            taken = (time.perf_counter() - start) / materials
            log(f"{name}: {taken:.5f} s")
            if round_:  # the first one compiles or records
                seconds[name].append(taken)
    medians = {name: statistics.median(taken) for name, taken in seconds.items()}
    kernel = next(iter(medians.values()))
    rows = [(name, f"{taken:.5f}", f"{kernel / taken:.2f}x") for name, taken in medians.items()]
    card = torch.cuda.get_device_name(options.device) if "cuda" in options.device else "CPU"
    study.table(
        ("", "s per material and epoch", "speed"),
        rows,
        note=f"An epoch is {blocks * BLOCK:,} samples; {cores} cores; {card}; {torch.__version__}.",
    )


if __name__ == "__main__":
    main()
