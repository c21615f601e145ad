"""From any reflectance to an NBRDF: the training recipe."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.files import NacreError
from nacre.neural.bound import bounded
from nacre.neural.inputs import ENHANCED, PAPER, input_count, turns_half_vector
from nacre.neural.nbrdf import HIDDEN, OUTPUTS, Layer, NeuralBrdf
from nacre.neural.samples import BLOCK, Samples, draw
from nacre.neural.scattered import (
    SCATTERED_SAMPLES,
    highest,
    scattered_samples,
    validation_errors,
)
from nacre.parallel import one_blas_thread
from nacre.sampling import DISTRIBUTIONS, fit_lobes

SAMPLES = 800_000
"""Samples of an isotropic material (NBRDF paper, section 3.1)."""
ENHANCED_GAIN = 32.0
"""Default gain of the loss with enhanced inputs."""
ANISOTROPIC_FACTOR = 5
"""What a network without h turned to phi_h = 0 takes more (ibid., of anisotropic materials)."""

Progress = Callable[[str, int, int, str], None]
"""Called as `progress(stage, done, total, note)`."""


class Trainer(Protocol):
    """Weights and optimiser state of one network on some device."""

    def epoch(
        self, samples: Samples, order: npt.NDArray[np.int64], rates: npt.NDArray[np.float32]
    ) -> float:
        """One Adam step per learning rate over blocks in the given order; mean training loss."""
        ...

    def loss(self, samples: Samples) -> float:
        """Mean loss over all samples."""
        ...

    def layers(self) -> list[Layer]:
        """Copies of the current layers."""
        ...


@dataclass(frozen=True)
class Recipe:
    """Settings of a fit; the defaults are the recommended recipe.

    Parameters
    ----------
    hidden
        Widths of the hidden layers; (21, 21) is the paper's network of 675 weights. The network
        of a scan has one more, of three units: see :func:`nacre.neural.bound.bounded`.
    epochs
        Passes over the training samples; 20 make a draft.
    samples
        Samples drawn, held-out ones included; None for 800,000, or 4,000,000 if the material is
        anisotropic or the inputs are stereographic. Of a scan with scattered samples: training
        samples, filling between them included; None for 320,000, or 1,600,000.
    batch
        Samples an optimiser step, a multiple of 16; a scan takes half as many.
    learning_rate
        Peak of the schedule: linear warm-up over 2 % of the steps, then a cosine to zero;
        half of it for a scan.
    held_out
        Share of the samples that is never trained on; of a scan, share of its own samples.
    seed
        The same seed gives the same network on the same machine.
    inputs
        What the network sees of the directions: "paper", "enhanced" or "stereographic", see
        :func:`nacre.neural.inputs.network_inputs`.
    gain
        Factor k of the loss |log(1 + k f cos) - log(1 + k f' cos)|: the paper's is 1; more of it
        counts what is dark, as eyes and tone mapping do. None for 1 with the paper's inputs and 32
        with enhanced ones. A scan has a loss of its own.
    sampling
        How training directions are distributed, one of :data:`nacre.sampling.DISTRIBUTIONS`; None
        for "rusinkiewicz", as in the paper, or "mixed" with enhanced inputs. A scan has its own.
    """

    hidden: tuple[int, ...] = HIDDEN
    epochs: int = 100
    samples: int | None = None
    batch: int = 512
    learning_rate: float = 1e-2
    held_out: float = 0.2
    seed: int = 0
    inputs: str = PAPER
    gain: float | None = None
    sampling: str | None = None

    def __post_init__(self) -> None:
        input_count(self.inputs, True)
        if self.gain is not None and not 0 < self.gain <= 1e6:
            raise ValueError(f"gain must lie between 0 and a million, got {self.gain}")
        for name, value in (
            ("epochs", self.epochs),
            ("samples", 1 if self.samples is None else self.samples),
            *(("hidden", width) for width in self.hidden),
        ):
            if value < 1:
                raise ValueError(f"{name} must be positive, got {value}")
        if not 0 < self.learning_rate < math.inf:
            raise ValueError(f"learning_rate must be positive, got {self.learning_rate}")
        if not 0 < self.held_out < 1:
            raise ValueError(f"held_out must lie between 0 and 1, got {self.held_out}")
        if self.distribution not in DISTRIBUTIONS:
            known = ", ".join(DISTRIBUTIONS)
            raise ValueError(f"sampling must be one of {known}, got {self.sampling!r}")
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")
        if self.batch < BLOCK or self.batch % BLOCK:
            raise ValueError(f"batch must be a positive multiple of {BLOCK}, got {self.batch}")
        if self.samples is not None and self.samples * (1 - self.held_out) < 2 * BLOCK:
            raise ValueError(f"samples must leave some to train on, got {self.samples}")

    @property
    def loss_gain(self) -> float:
        """The gain, or its default."""
        if self.gain is not None:
            return self.gain
        return ENHANCED_GAIN if self.inputs == ENHANCED else 1.0

    @property
    def distribution(self) -> str:
        """The sampling, or its default."""
        if self.sampling is not None:
            return self.sampling
        return "mixed" if self.inputs == ENHANCED else "rusinkiewicz"


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
        recipe = replace(recipe, batch=half, learning_rate=0.5 * recipe.learning_rate)
    count = recipe.samples or factor * (SAMPLES if scan is None else SCATTERED_SAMPLES)
    report = progress or (lambda stage, done, total, note: None)
    inputs = input_count(recipe.inputs, isotropic)
    trainer = _trainer(initial_layers(recipe.hidden, recipe.seed, inputs), recipe.batch, device)

    def sampled(done: int, total: int) -> None:
        report("sampling", done, total, "")

    chosen = recipe.held_out, recipe.seed
    if scan is None:
        options = recipe.inputs, recipe.loss_gain, recipe.distribution
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
    network = NeuralBrdf(layers, isotropic=isotropic, name=brdf.name, inputs=recipe.inputs)
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
        "sampling": recipe.distribution if scan is None else None,
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
    """Run the schedule of a recipe; returns the last training and held-out losses."""
    batch_blocks = recipe.batch // BLOCK
    steps = -(-training.block_count // batch_blocks)
    rates = schedule(steps * recipe.epochs, recipe.learning_rate)
    random = np.random.default_rng((recipe.seed, 1))
    report_every = max(1, recipe.epochs // 20)
    loss = held_out_loss = math.nan
    for epoch in range(recipe.epochs):
        order = random.permutation(training.block_count)
        loss = trainer.epoch(training, order, rates[epoch * steps : (epoch + 1) * steps])
        last = epoch + 1 == recipe.epochs
        if last or (progress and epoch % report_every == 0):
            held_out_loss = trainer.loss(held_out)
        if progress:
            note = f"held-out loss {held_out_loss:.5f}"
            progress("training", epoch + 1, recipe.epochs, note)
    return {"training_loss": loss, "held_out_loss": held_out_loss}


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
