"""Settings of the training of bases whose codes stand for networks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class HypernetworkRecipe:
    """Settings of the training of a hypernetwork; the defaults are the recommended ones.

    Parameters
    ----------
    width
        Units of both of its hidden layers.
    steps
        Optimiser steps.
    codes
        Materials that one step sees.
    directions
        Pairs of directions at which it sees them.
    learning_rate
        Peak of the schedule of :func:`nacre.neural.training.schedule`.
    seed
        The same seed gives the same hypernetwork on the same machine.
    """

    width: int = 128
    steps: int = 8000
    codes: int = 192
    directions: int = 64
    learning_rate: float = 6e-3
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("width", "steps", "codes", "directions"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


@dataclass(frozen=True)
class AutoencoderRecipe:
    """Settings of the training of an autoencoder; the defaults are the recommended ones.

    Parameters
    ----------
    values
        k, the values of a code.
    width
        Units of both hidden layers.
    mixtures
        Geometric means of two materials that are trained on besides the materials.
    steps
        Optimiser steps.
    networks
        Networks that one step sees.
    pixels
        Pixels at which it sees them, of all pictures.
    learning_rate
        Peak of the schedule of :func:`nacre.neural.training.schedule`.
    seed
        The same seed gives the same autoencoder on the same machine.
    """

    values: int = 32
    width: int = 256
    mixtures: int = 300
    steps: int = 4000
    networks: int = 64
    pixels: int = 256
    learning_rate: float = 2e-3
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("values", "width", "steps", "networks", "pixels"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        if self.mixtures < 0:
            raise ValueError(f"mixtures must not be negative, got {self.mixtures}")
