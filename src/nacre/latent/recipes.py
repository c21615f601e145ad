"""Settings for training bases and what belongs to them; the defaults are the recommended ones.

The learning rate is the peak of :func:`nacre.neural.training.schedule`; `steps` are those of the
optimizer. The same seed gives the same result on the same machine.
"""

from __future__ import annotations

from dataclasses import dataclass

from nacre.measured.merl import Resolution
from nacre.neural.recipe import check_positive

GAIN = 30.0  # k of the loss log(1 + k f cos theta_i) of all trainings and codes
RESOLUTION = Resolution(90, 45, 45)  # of the grid of principal components


@dataclass(frozen=True)
class PcaRecipe:
    """Settings of principal components."""

    code_dim: int = 32  # values in a code, at most as many as the materials support
    resolution: Resolution = RESOLUTION  # a fifth of the memory of the MERL database's own grid
    separate: bool = False
    """Take each channel as a material of its own, as Nielsen et al. do: a component then has three
    values, for red, green and blue."""

    def __post_init__(self) -> None:
        check_positive(self, "code_dim")


@dataclass(frozen=True)
class BasisRecipe:
    """Settings for training a neural basis."""

    code_dim: int = 32  # values in a code
    hidden: tuple[int, ...] = (96, 96, 96)  # widths of the hidden layers
    steps: int = 8000
    directions: int = 1 << 16  # pairs of directions that the materials are known at
    batch: int = 256  # how many of them one step sees, of all materials
    learning_rate: float = 5e-3
    seed: int = 0
    predictors: bool = True  # whether lobe predictors are trained as well

    def __post_init__(self) -> None:
        check_positive(self, "code_dim", "steps", "directions", "batch")
        if not self.hidden or min(self.hidden) < 1:
            raise ValueError(f"hidden must be widths of layers, got {self.hidden}")

    @property
    def pairs(self) -> int:
        """p, the pairs of values for chroma: as many as principal components take."""
        return max(5 * self.code_dim // 32, min(1, self.code_dim // 3))


@dataclass(frozen=True)
class PredictorRecipe:
    """Settings for training lobe predictors."""

    hidden: int = 128  # width of the hidden layer
    codes: int = 8192  # codes to train on: of materials, mixtures of two, and random ones
    sets: int = 16  # sets of directions, each for an equal part of the codes
    lights: int = 128  # directions to the light for each of a set's views
    steps: int = 3000
    batch: int = 32  # codes that a step sees
    learning_rate: float = 1e-2
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive(self, "hidden", "codes", "sets", "lights", "steps", "batch")


@dataclass(frozen=True)
class HypernetworkRecipe:
    """Settings for training a hypernetwork."""

    code_dim: int = 32  # values in a code, where a neural basis is trained for it
    width: int = 128  # units of both of its hidden layers
    steps: int = 8000
    codes: int = 192  # materials that one step sees
    directions: int = 64  # pairs of directions at which it sees them
    learning_rate: float = 6e-3
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive(self, "code_dim", "width", "steps", "codes", "directions")


@dataclass(frozen=True)
class AutoencoderRecipe:
    """Settings for training an autoencoder."""

    code_dim: int = 32  # values in a code
    width: int = 256  # units of both hidden layers
    mixtures: int = 12000  # mixtures of one to four materials to train on besides these
    steps: int = 8000
    networks: int = 128  # networks that one step sees
    pixels: int = 96  # pixels at which it sees them, of all pictures
    learning_rate: float = 2e-3
    seed: int = 0
    predictors: bool = True  # whether lobe predictors are trained as well

    def __post_init__(self) -> None:
        check_positive(self, "code_dim", "width", "steps", "networks", "pixels")
        if self.mixtures < 0:
            raise ValueError(f"mixtures must not be negative, got {self.mixtures}")
