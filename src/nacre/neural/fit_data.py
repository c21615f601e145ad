"""What comes before training and after it, wherever that runs."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from nacre.brdf import Brdf, expect_brdf
from nacre.errors import NacreError
from nacre.neural.inputs import PAPER, input_count, rotates_half_vector
from nacre.neural.nbrdf import SINGLE, NeuralBrdf, round_layers
from nacre.neural.physical import limited
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK, Samples, draw
from nacre.neural.scattered import (
    SCATTERED_SAMPLES,
    clamped,
    highest,
    scattered_samples,
    validation_errors,
)
from nacre.neural.training import initial_layers
from nacre.numerics.direction_samples import Scattered
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.progress import Progress
from nacre.sampling import check_isotropic, fit_lobes
from nacre.sampling.projection import Projection

SAMPLES = 800_000  # samples of an isotropic material (NBRDF paper, section 3.1)
ANISOTROPIC_FACTOR = 5  # how many times as many samples networks that see phi_h take (ibid.)


@dataclass(frozen=True)
class FitData:
    """What a fit needs of a reflectance once it is sampled; tables can be released.

    `isotropic` is whether h is rotated to phi_h = 0, `scan` the scattered samples that the others
    come from. The recipe leaves nothing open.
    """

    name: str
    about: Mapping[str, Any]  # source, channels and notes of the material
    isotropic: bool
    scan: Scattered | None
    recipe: Recipe
    training: Samples
    held_out: Samples

    @property
    def shape(self) -> Hashable:
        """What materials must have in common to train as one batch."""
        return self.recipe, self.training.inputs, self.training.block_count

    @property
    def size(self) -> int:
        """Bytes of the samples."""
        return self.training.blocks.nbytes + self.held_out.blocks.nbytes

    def initial_layers(self, start: int = 0) -> list[Layer]:
        """Where training begins; each start has its own weights."""
        return initial_layers(self.recipe.hidden, self.recipe.seed, self.training.inputs, start)

    def finish(self, layers: Sequence[Layer], quality: Mapping[str, float]) -> NeuralBrdf:
        """The network of trained layers; NacreError if its losses are not finite."""
        recipe, scan = self.recipe, self.scan
        if not math.isfinite(sum(quality.values())):
            raise NacreError(
                f"{self.name or 'reflectance'}: training diverged; lower the learning rate"
            )
        chosen = recipe.held_out, recipe.seed
        if scan is not None:
            layers = clamped(layers, highest(scan, *chosen))
        network = NeuralBrdf(
            round_layers(layers, recipe.stored_precision),
            isotropic=self.isotropic,
            name=self.name,
            inputs=recipe.chosen_inputs,
            precision=recipe.stored_precision,
            activation=recipe.hidden_activation,
            angle=self.training.angle,
        )
        if scan is not None:
            judged = validation_errors(scan, scan.samples.rgb, network.eval, *chosen)
            quality = {**quality, **judged}
        settings = asdict(recipe) | {
            "hidden": list(recipe.hidden),
            "gain": recipe.loss_gain if scan is None else None,
            "sampling": recipe.sampling if scan is None else None,
        }
        metadata: dict[str, Any] = {"fit": settings, "quality": dict(quality)}
        if source := self.about["source"]:
            metadata["source"] = dict(source)
        with one_blas_thread():
            channels, notes = self.about["channels"], self.about["notes"]
            network = network.replaced(metadata=metadata, channels=channels, notes=notes)
            if recipe.physical:
                network = limited(network)
            return network.replaced(sampler=fit_lobes(network))


def prepare(brdf: Brdf, recipe: Recipe, progress: Progress) -> FitData:
    """Settle what a recipe leaves open, and draw the samples.

    Raises NacreError if hardly any sample is valid, `brdf` is not isotropic although it says so, or
    a scan has too few samples, is to be physical or to have squared ReLUs; TypeError if `brdf` is
    no reflectance.
    """
    expect_brdf(brdf, "a fit")
    check_isotropic(brdf)
    scan = brdf.scattered()
    if recipe.physical:
        if scan is not None:
            raise NacreError(
                f"{brdf.name or 'scan'}: is known at scattered samples only; fit a network to it "
                "as it is, and a physical one to that network"
            )
        progress("projecting", 0, 1, "")
        brdf = Projection(brdf)
        progress("projecting", 1, 1, "")
    if scan is not None:
        if recipe.activation == SQUARED_RELU:
            raise NacreError(
                f"{brdf.name or 'scan'}: networks for scans have ReLUs, the last of which clamp "
                "them; leave the activation unset"
            )
        half = max(BLOCK, recipe.batch // (2 * BLOCK) * BLOCK)
        # Rounded weights would not clamp a scan exactly.
        recipe = replace(
            recipe,
            batch=half,
            learning_rate=0.5 * recipe.learning_rate,
            inputs=PAPER if recipe.inputs is None else recipe.inputs,
            precision=recipe.precision or SINGLE,
            activation=recipe.activation or RELU,
            gain=1.0,  # of the held-out samples
        )
    inputs = recipe.chosen_inputs
    isotropic = rotates_half_vector(inputs, brdf.isotropic)
    factor = 1 if isotropic else ANISOTROPIC_FACTOR
    usual = factor * (SAMPLES if scan is None else SCATTERED_SAMPLES)
    count = recipe.samples or max(4 * BLOCK, round(recipe.sample_share * usual))
    recipe = replace(
        recipe,
        inputs=inputs,
        samples=count,
        hidden=tuple(recipe.widths(input_count(inputs, isotropic))),
        precision=recipe.stored_precision,
        activation=recipe.hidden_activation,
    )

    def sampled(done: int, total: int) -> None:
        progress("sampling", done, total, "")

    if scan is None:
        options = inputs, recipe.loss_gain, recipe.sampling
        drawn = draw(brdf, count, recipe.seed, sampled, *options)
        parts = drawn.split(recipe.held_out)
    else:
        chosen = recipe.held_out, recipe.seed
        parts = scattered_samples(scan, count, *chosen, sampled, inputs)
    about = {name: getattr(brdf, name) for name in ("source", "channels", "notes")}
    return FitData(brdf.name, about, isotropic, scan, recipe, *parts)
