"""Settings of a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nacre.neural.inputs import ENHANCED, RECIPROCAL, input_count
from nacre.neural.nbrdf import ACTIVATIONS, HALF, HIDDEN, OUTPUTS, PRECISIONS, SINGLE
from nacre.neural.samples import BLOCK
from nacre.numerics.mlp import RELU, SQUARED_RELU
from nacre.sampling import DISTRIBUTIONS

ENHANCED_GAIN = 32.0  # default gain of the loss with enhanced inputs


PRESETS: Mapping[str, Mapping[str, Any]] = {
    "draft": {"sample_share": 0.125, "learning_rate": 2e-2},
    "standard": {},
    "best": {"epochs": 1000},
}
"""Settings of a :class:`Recipe` by name, taking about 0.3 s, 1.5 s and 12 s for an isotropic
material on two idle server cores (`docs/results/speed.md`)."""


SPECTRAL_PRESETS: Mapping[str, Mapping[str, Any]] = {
    "draft": {"sample_share": 0.125, "learning_rate": 5e-3},
    "standard": {"epochs": 60},
    "best": {"epochs": 200},
}
"""The same for spectral networks, on top of :data:`SPECTRAL`."""

SPECTRAL: Mapping[str, Any] = {"hidden": (32, 32, 32), "learning_rate": 3.5e-3}
"""Settings of spectral networks that differ from the defaults: wider layers, one more of them, and
smaller steps, with which three layers of squares train reliably."""


@dataclass(frozen=True)
class Recipe:
    """Settings of a fit; the defaults are the recommended recipe."""

    hidden: tuple[int, ...] = HIDDEN
    """Widths of the hidden layers; (21, 21) is the paper's network of 675 weights. The network for
    a scan has one more, of three units: see :func:`nacre.neural.scattered.clamped`."""
    size: int | None = None
    """Bytes that the weights may take: two hidden layers as wide as they allow, in place of
    `hidden`. The extra layer for a scan is not counted."""
    epochs: int = 100
    """Passes over the training samples."""
    samples: int | None = None
    """Samples drawn, held-out ones included; None for 800,000, or 4,000,000 if the material is
    anisotropic or the inputs are stereographic. For a scan: training samples, interpolated ones
    included; None for 320,000, or 1,600,000."""
    sample_share: float = 1.0
    """How many of those are drawn where `samples` is None."""
    batch: int = 512
    """Samples per optimizer step, a multiple of 16; a scan takes half as many."""
    starts: int = 4
    """Networks with different random weights that are trained at first, for a twentieth of the
    epochs each; the one with the smallest held-out loss goes on. With fewer than 20 epochs, and in
    stacks on a PyTorch device, there is one."""
    learning_rate: float = 1e-2
    """Peak of the schedule: linear warm-up over 2 % of the steps, then a cosine to zero; half of it
    for a scan."""
    held_out: float = 0.2
    """Fraction of the samples that is never trained on; for a scan, fraction of its own samples."""
    seed: int = 0
    """The same seed gives the same network on the same machine."""
    inputs: str | None = None
    """What the network sees of the directions: "enhanced", "paper" or "stereographic", see
    :func:`nacre.neural.inputs.network_inputs`. None for enhanced, and for the paper's with a scan,
    which they fit better."""
    gain: float | None = None
    """Factor k of the loss |log(1 + k f cos) - log(1 + k f' cos)|: the paper's is 1; a larger one
    gives more weight to what is dark, as eyes and tone mapping do. None for 32 with enhanced inputs
    and 1 with others. A scan has a loss of its own."""
    sampling: str = "mixed"
    """How training directions are distributed, one of :data:`nacre.sampling.DISTRIBUTIONS`; the
    paper's is "rusinkiewicz". A scan has its own."""
    precision: str | None = None
    """How weights are stored, "single" or "half". None for half with enhanced and reciprocal
    inputs, and for single with others and with a scan, whose clamp layer rounding would spoil."""
    activation: str | None = None
    """What follows the hidden layers, "relu" or "squared relu". None for squares with enhanced
    inputs, and for the paper's ReLU with others and with a scan, whose clamp layer needs it. With
    squares a physical fit may gain energy without bound where there is hardly any sample."""
    physical: bool = False
    """Fit a network that is reciprocal, positive, and reflects no more light than it gets; see
    :mod:`nacre.neural.physical`. Its inputs are "reciprocal", in place of `inputs`."""

    def __post_init__(self) -> None:
        inputs = input_count(self.chosen_inputs, True)
        if self.physical != (self.chosen_inputs == RECIPROCAL):
            raise ValueError(f"physical fits have reciprocal inputs, and no others: {self.inputs}")
        check_positive(self, "epochs", "starts", "samples", "hidden")
        distributions, precisions, activations = (
            ", ".join(names) for names in (DISTRIBUTIONS, PRECISIONS, ACTIVATIONS)
        )
        blocks = self.batch >= BLOCK and self.batch % BLOCK == 0
        for name, fits, rule in (
            ("gain", self.gain is None or 0 < self.gain <= 1e6, "lie between 0 and a million"),
            ("sample_share", 0 < self.sample_share <= 100, "lie above 0"),
            ("learning_rate", 0 < self.learning_rate < math.inf, "be positive"),
            ("held_out", 0 < self.held_out < 1, "lie between 0 and 1"),
            ("sampling", self.sampling in DISTRIBUTIONS, f"be one of {distributions}"),
            ("precision", self.stored_precision in PRECISIONS, f"be one of {precisions}"),
            ("activation", self.hidden_activation in ACTIVATIONS, f"be one of {activations}"),
            ("seed", self.seed >= 0, "not be negative"),
            ("batch", blocks, f"be a positive multiple of {BLOCK}"),
        ):
            if not fits:
                raise ValueError(f"{name} must {rule}, got {getattr(self, name)!r}")
        if self.size is not None:
            self.widths(inputs)
        if self.samples is not None and self.samples * (1 - self.held_out) < 2 * BLOCK:
            raise ValueError(f"samples must leave some to train on, got {self.samples}")

    @classmethod
    def preset(cls, name: str, **settings: Any) -> Recipe:
        """One of :data:`PRESETS`, with other settings if you like.

        Raises ValueError if there is no such preset, or a setting is impossible.
        """
        if name not in PRESETS:
            raise ValueError(f"preset must be one of {', '.join(PRESETS)}, got {name!r}")
        return cls(**{**PRESETS[name], **settings})

    @classmethod
    def spectral(cls, name: str = "standard", **settings: Any) -> Recipe:
        """As :meth:`preset`, for a spectral network: one of :data:`SPECTRAL_PRESETS`."""
        cls.preset(name)
        return cls(**{**SPECTRAL, **SPECTRAL_PRESETS[name], **settings})

    @property
    def chosen_inputs(self) -> str:
        """The inputs, or their default for any material but a scan."""
        if self.inputs is not None:
            return self.inputs
        return RECIPROCAL if self.physical else ENHANCED

    @property
    def offset(self) -> float:
        """What is subtracted from e^x of the outputs x: 0 where f_r has to be positive."""
        return 0.0 if self.physical else 1.0

    @property
    def loss_gain(self) -> float:
        if self.gain is not None:
            return self.gain
        return ENHANCED_GAIN if self.chosen_inputs in (ENHANCED, RECIPROCAL) else 1.0

    @property
    def stored_precision(self) -> str:
        if self.precision is not None:
            return self.precision
        return HALF if self.chosen_inputs in (ENHANCED, RECIPROCAL) else SINGLE

    @property
    def hidden_activation(self) -> str:
        if self.activation is not None:
            return self.activation
        return SQUARED_RELU if self.chosen_inputs == ENHANCED else RELU

    def widths(self, inputs: int) -> tuple[int, ...]:
        """Widths of the hidden layers for so many inputs; ValueError if `size` is too small."""
        if self.size is None:
            return self.hidden
        limit = self.size // PRECISIONS[self.stored_precision].itemsize
        # a b + (inputs + 1) a + (OUTPUTS + 1) b + OUTPUTS weights, of which b = a or a - 1.
        linear = inputs + OUTPUTS + 2
        width = int((math.sqrt(linear * linear + 4.0 * max(limit - OUTPUTS, 0)) - linear) / 2.0)
        wider = (width + 1) * (width + inputs + 1) + (OUTPUTS + 1) * width + OUTPUTS
        if width < 1:
            raise ValueError(f"size {self.size} is too small for a network")
        return (width + 1 if wider <= limit else width), width


def check_positive(recipe: object, *names: str) -> None:
    """Raise ValueError for settings below 1, and for such widths; None stands for the default."""
    for name in names:
        setting = getattr(recipe, name)
        for value in setting if isinstance(setting, Sequence) else [setting]:
            if value is not None and value < 1:
                raise ValueError(f"{name} must be positive, got {value}")
