"""From any reflectance to an NBRDF: the training recipe."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.files import NacreError
from nacre.neural.bound import bounded
from nacre.neural.inputs import input_count, turns_half_vector
from nacre.neural.nbrdf import OUTPUTS, SINGLE, Layer, NeuralBrdf, round_layers
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK, Samples, draw
from nacre.neural.scattered import (
    SCATTERED_SAMPLES,
    highest,
    scattered_samples,
    validation_errors,
)
from nacre.parallel import one_blas_thread
from nacre.progress import Progress
from nacre.sampling import fit_lobes

SAMPLES = 800_000
"""Samples of an isotropic material (NBRDF paper, section 3.1)."""
ANISOTROPIC_FACTOR = 5
"""What a network without h turned to phi_h = 0 takes more (ibid., of anisotropic materials)."""


class Trainer(Protocol):
    """Weights and optimiser state of one network on some device."""

    def epoch(
        self, samples: Samples, order: npt.NDArray[np.int64], rates: npt.NDArray[np.float32]
    ) -> None:
        """One Adam step per learning rate over blocks in the given order."""
        ...

    def loss(self, samples: Samples) -> float:
        """Mean loss over all samples."""
        ...

    def layers(self) -> list[Layer]:
        """Copies of the current layers."""
        ...


def fit(
    brdf: Brdf,
    recipe: Recipe | None = None,
    *,
    device: str | None = None,
    progress: Progress | None = None,
) -> NeuralBrdf:
    """Fit an NBRDF to a reflectance.

    Parameters
    ----------
    brdf
        Any reflectance. One that offers scattered samples (:meth:`nacre.Brdf.scattered`) is fitted
        to these, as :mod:`nacre.neural.scattered` has it.
    recipe
        Settings; the defaults of :class:`Recipe` where None.
    device
        None for the compiled CPU kernel; a PyTorch device ("cpu", "cuda") for the same recipe in
        plain PyTorch.
    progress
        Called as the fit goes on.

    Returns
    -------
    NeuralBrdf
        With importance sampling lobes fitted to it, and the settings and losses in its metadata.

    Raises
    ------
    NacreError
        If hardly any sample of the reflectance is valid, if a scan has too few, if training does
        not converge, or if there is no such device.
    MissingExtraError
        If a device is given and PyTorch is not installed.

    Notes
    -----
    The loss is equation 1 of the NBRDF paper; that of scans differs, see
    :mod:`nacre.neural.scattered`, which also says how they are kept from rising towards the
    horizon. The output is not clamped while training: a ReLU there kills colour channels for good.
    """
    recipe = recipe or Recipe()
    isotropic = turns_half_vector(recipe.inputs, brdf.isotropic)
    factor = 1 if isotropic else ANISOTROPIC_FACTOR
    scan = brdf.scattered()
    if scan is not None:
        half = max(BLOCK, recipe.batch // (2 * BLOCK) * BLOCK)
        # Rounded weights would not keep the bound of a scan.
        recipe = replace(
            recipe,
            batch=half,
            learning_rate=0.5 * recipe.learning_rate,
            precision=recipe.precision or SINGLE,
        )
    usual = factor * (SAMPLES if scan is None else SCATTERED_SAMPLES)
    count = recipe.samples or max(4 * BLOCK, round(recipe.sample_share * usual))
    report = progress or (lambda stage, done, total, note: None)
    inputs = input_count(recipe.inputs, isotropic)
    precision = recipe.stored_precision
    recipe = replace(recipe, hidden=recipe.widths(inputs), precision=precision)
    trainer = _trainer(initial_layers(recipe.hidden, recipe.seed, inputs), recipe.batch, device)

    def sampled(done: int, total: int) -> None:
        report("sampling", done, total, "")

    chosen = recipe.held_out, recipe.seed
    if scan is None:
        options = recipe.inputs, recipe.loss_gain, recipe.sampling
        drawn = draw(brdf, count, recipe.seed, sampled, *options)
        training, held_out = drawn.split(recipe.held_out)
    else:
        training, held_out = scattered_samples(scan, count, *chosen, sampled, recipe.inputs)
    quality = train(trainer, training, held_out, recipe, progress)
    if not math.isfinite(sum(quality.values())):
        raise NacreError(
            f"{brdf.name or 'reflectance'}: training diverged; lower the learning rate"
        )
    layers = trainer.layers()
    if scan is not None:
        layers = bounded(layers, highest(scan, *chosen))
    network = NeuralBrdf(
        round_layers(layers, precision),
        isotropic=isotropic,
        name=brdf.name,
        inputs=recipe.inputs,
        precision=precision,
    )
    if scan is not None:
        quality |= validation_errors(scan, network, *chosen)
    report("sampling lobes", 0, 1, "")
    with one_blas_thread():
        network.sampler = fit_lobes(network)
    report("sampling lobes", 1, 1, "")
    settings = asdict(recipe) | {
        "hidden": list(recipe.hidden),
        "samples": count,
        "gain": recipe.loss_gain if scan is None else None,
        "sampling": recipe.sampling if scan is None else None,
    }
    network.metadata = {"fit": settings, "quality": quality}
    if brdf.source:
        network.metadata["source"] = dict(brdf.source)
    return network


def train(
    trainer: Trainer,
    training: Samples,
    held_out: Samples,
    recipe: Recipe,
    progress: Progress | None = None,
) -> dict[str, float]:
    """Run the schedule of a recipe; returns the training and held-out losses at its end."""
    batch_blocks = recipe.batch // BLOCK
    steps = -(-training.block_count // batch_blocks)
    rates = schedule(steps * recipe.epochs, recipe.learning_rate)
    random = np.random.default_rng((recipe.seed, 1))
    report_every = max(1, recipe.epochs // 20)
    held_out_loss = math.nan
    for epoch in range(recipe.epochs):
        order = random.permutation(training.block_count)
        trainer.epoch(training, order, rates[epoch * steps : (epoch + 1) * steps])
        last = epoch + 1 == recipe.epochs
        if last or (progress and epoch % report_every == 0):
            held_out_loss = trainer.loss(held_out)
        if progress:
            note = f"held-out loss {held_out_loss:.5f}"
            progress("training", epoch + 1, recipe.epochs, note)
    return {"training_loss": trainer.loss(training), "held_out_loss": held_out_loss}


def schedule(steps: int, peak: float) -> npt.NDArray[np.float32]:
    """Learning rate of every step: linear warm-up over 2 %, then a cosine to zero."""
    step = np.arange(steps)
    warm_up = max(1, steps // 50)
    decay = np.clip((step - warm_up) / max(1, steps - warm_up), 0.0, 1.0)
    rate = peak * np.minimum((step + 1) / warm_up, 0.5 + 0.5 * np.cos(math.pi * decay))
    return rate.astype(np.float32)


def initial_layers(hidden: Sequence[int], seed: int, inputs: int = 6) -> list[Layer]:
    """Normal weights of variance 2 / inputs (He et al. 2015) and zero biases."""
    random = np.random.default_rng((seed, 2))
    return [
        Layer(
            random.normal(0.0, math.sqrt(2.0 / rows), (rows, columns)).astype(np.float32),
            np.zeros(columns, np.float32),
        )
        for rows, columns in itertools.pairwise((inputs, *hidden, OUTPUTS))
    ]


def _trainer(layers: Sequence[Layer], batch: int, device: str | None) -> Trainer:
    if device is None:
        from nacre.neural.kernel import KernelTrainer

        return KernelTrainer(layers, batch)
    from nacre.neural.torch import TorchTrainer

    return TorchTrainer(layers, batch, device)
