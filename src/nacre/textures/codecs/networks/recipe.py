"""Settings for training the networks."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nacre.numerics.muon import Muon, like_adam
from nacre.textures.codecs.networks.mlp import VARIANCES, Tensor, torch

OPTIMIZERS = "sgd", "adam", "muon"
LOSSES = "l1", "l2"
PRECISIONS = "single", "bfloat16"

RECIPES: Mapping[str, Mapping[str, Any]] = {
    "reference": {
        "epochs": 1000,
        "batch": 10,
        "encoder_fraction": 0.2,
        "encoder_directions": None,
        "loss_directions": None,
        "variance": "pytorch",
        "optimizer": "sgd",
        "learning_rate": 0.2,
        "warm_up": 0.0,
        "decay": False,
    },
    "default": {},
}
"""Settings of a :class:`TrainingRecipe` by name. The reference is that of Rainer et al. 2020,
section 4: stochastic gradient descent at a rate of 0.2 on 10 texels a step, all of their entries in
the loss and from a fifth to all of them in the encoder."""


@dataclass(frozen=True)
class TrainingRecipe:
    """Settings of a training; the defaults are the recommended ones.

    The same seed gives the same network on the same machine and number of threads. A ValueError
    says that a setting is impossible.
    """

    epochs: int = 100  # how often every data set gives new random texels
    texels: int = 100  # per data set and epoch
    batch: int = 128  # texels in a step, over all processes
    encoder_fraction: float = 1.0
    """Least fraction of entries that the encoder sees: each step draws one, up to 1."""
    encoder_directions: int | None = 4096
    """Most entries that the encoder sees, at random; None: all."""
    loss_directions: int | None = 64  # entries that the loss compares, at random; None: all
    loss: str = "l1"  # "l1" or "l2", on whitened logarithms
    permute: bool = True  # whether to permute the color channels of every texel at random
    variance: str = "he"  # of the first weights, "he" or "pytorch"; see `mlp.initial`
    optimizer: str = "muon"
    """One of "sgd", "adam", and "muon" (Jordan et al. 2024) on matrices with Adam on the rest."""
    learning_rate: float = 1e-2  # its peak
    warm_up: float = 0.02  # fraction of the training in which the rate rises from 0
    decay: bool = True  # whether the rate then falls to 0 along a cosine
    precision: str = "single"
    """Either "single" or "bfloat16", for products of matrices; weights are always single."""
    held_out: float = 0.05  # fraction of the texels of every data set that is never trained on
    validate_every: int = 200  # steps between validations: the loss on held-out texels
    patience: int = 0  # validations without a better loss that end the training; 0: never
    seed: int = 0

    def __post_init__(self) -> None:
        counts = ["epochs", "texels", "batch", "validate_every"]
        counts += [n for n in ("encoder_directions", "loss_directions") if getattr(self, n)]
        for name in counts:
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        if not 0 < (least := self.encoder_fraction) <= 1:
            raise ValueError(f"encoder_fraction must lie above 0, to 1, got {least}")
        for name in ("warm_up", "held_out"):
            if not 0 <= getattr(self, name) < 1:
                raise ValueError(f"{name} must lie between 0 and 1, got {getattr(self, name)}")
        if not 0 < self.learning_rate < math.inf:
            raise ValueError(f"learning_rate must be positive, got {self.learning_rate}")
        options: dict[str, Collection[str]] = {"variance": VARIANCES, "optimizer": OPTIMIZERS}
        options |= {"loss": LOSSES, "precision": PRECISIONS}
        for name, known in options.items():
            if (found := getattr(self, name)) not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, got {found!r}")
        if self.patience < 0 or self.seed < 0:
            raise ValueError("patience and seed must not be negative")

    @classmethod
    def named(cls, name: str, **settings: Any) -> TrainingRecipe:
        """One of :data:`RECIPES`, with other settings if you like.

        A ValueError says that there is no such recipe, or that a setting is impossible.
        """
        if name not in RECIPES:
            raise ValueError(f"recipe must be one of {', '.join(RECIPES)}, got {name!r}")
        return cls(**{**RECIPES[name], **settings})

    def rate(self, done: float) -> float:
        """Learning rate when a fraction `done` of the training is over."""
        if done < self.warm_up:
            return self.learning_rate * done / self.warm_up
        if not self.decay:
            return self.learning_rate
        left = (min(done, 1.0) - self.warm_up) / (1.0 - self.warm_up)
        return self.learning_rate * 0.5 * (1.0 + math.cos(math.pi * left))


_SMALLEST_MATRIX = 32
"""Smaller ones are left to Adam where Muon is asked for: it makes all singular values alike."""


@dataclass(frozen=True)
class NetworkRecipe:
    """A network and its training, which lasts so many steps or minutes, one of them at most, in
    place of its epochs.
    """

    settings: Any  # sizes of the network
    training: TrainingRecipe = TrainingRecipe()
    steps: int | None = None
    minutes: float | None = None
    device: str = "cpu"  # a PyTorch device
    save_every: float = 45.0
    """Seconds between checkpoints: no more is lost when the process is killed."""


def optimizers(parameters: Sequence[Tensor], recipe: TrainingRecipe) -> list[Any]:
    """Optimizers that take a step together; the training sets their rates at every step."""
    rate = recipe.learning_rate
    if recipe.optimizer == "sgd":
        return [torch.optim.SGD(parameters, lr=rate)]

    def adam(some: Sequence[Tensor]) -> Any:
        return torch.optim.Adam(some, lr=rate, betas=(0.9, 0.99), fused=True)

    matrices = [p for p in parameters if p.ndim == 2 and min(p.shape) >= _SMALLEST_MATRIX]
    if recipe.optimizer == "adam" or not matrices:
        return [adam(parameters)]
    rest = [p for p in parameters if not any(p is m for m in matrices)]
    return [Muon(matrices, rate, like_adam), adam(rest)]
