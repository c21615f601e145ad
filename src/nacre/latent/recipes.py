"""Settings of the trainings of bases and of what belongs to them."""

from __future__ import annotations

from dataclasses import dataclass

from nacre.measured.merl import Resolution
from nacre.neural.recipe import check_positive

GAIN = 30.0  # k of the loss log(1 + k f cos theta_i) of all trainings and codes
RESOLUTION = Resolution(90, 45, 45)  # of the grid of principal components


@dataclass(frozen=True)
class PcaRecipe:
    """Settings of principal components; the defaults are the recommended ones.

    Parameters
    ----------
    code_dim
        Number of values in a code, at most as many as the materials support.
    resolution
        Nodes of the grid: by default a fifth of the memory of the MERL database's own.
    separate
        Take each channel as a material of its own, as Nielsen et al. do: a component then has
        three values, for red, green and blue.
    """

    code_dim: int = 32
    resolution: Resolution = RESOLUTION
    separate: bool = False

    def __post_init__(self) -> None:
        check_positive(self, "code_dim")


@dataclass(frozen=True)
class BasisRecipe:
    """Settings of the training of a neural basis; the defaults are the recommended ones.

    Parameters
    ----------
    code_dim
        Number of values in a code.
    hidden
        Widths of the hidden layers.
    steps
        Optimizer steps.
    directions
        Pairs of directions that the materials are known at.
    batch
        How many of them one step sees, of all materials.
    learning_rate
        Peak of the schedule of :func:`nacre.neural.training.schedule`.
    seed
        The same seed gives the same basis on the same machine.
    predictors
        Whether predictors of lobes for importance sampling are trained as well.
    """

    code_dim: int = 32
    hidden: tuple[int, ...] = (96, 96, 96)
    steps: int = 8000
    directions: int = 1 << 16
    batch: int = 256
    learning_rate: float = 5e-3
    seed: int = 0
    predictors: bool = True

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
    """Settings of the training of lobe predictors; the defaults are the recommended ones.

    Parameters
    ----------
    hidden
        Width of the hidden layer.
    codes
        How many there are to train on: codes of materials, mixtures of two, and random ones.
    sets
        Sets of directions, each for an equal part of the codes.
    lights
        Directions to the light for each of a set's views.
    steps
        Optimizer steps.
    batch
        Codes that a step sees.
    learning_rate
        Peak of the schedule of :func:`nacre.neural.training.schedule`.
    seed
        The same seed gives the same predictor on the same machine.
    """

    hidden: int = 128
    codes: int = 8192
    sets: int = 16
    lights: int = 128
    steps: int = 3000
    batch: int = 32
    learning_rate: float = 1e-2
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive(self, "hidden", "codes", "sets", "lights", "steps", "batch")


@dataclass(frozen=True)
class HypernetworkRecipe:
    """Settings of the training of a hypernetwork; the defaults are the recommended ones.

    Parameters
    ----------
    code_dim
        Number of values in a code; of the neural basis, where one is trained for it.
    width
        Units of both of its hidden layers.
    steps
        Optimizer steps.
    codes
        Materials that one step sees.
    directions
        Pairs of directions at which it sees them.
    learning_rate
        Peak of the schedule of :func:`nacre.neural.training.schedule`.
    seed
        The same seed gives the same hypernetwork on the same machine.
    """

    code_dim: int = 32
    width: int = 128
    steps: int = 8000
    codes: int = 192
    directions: int = 64
    learning_rate: float = 6e-3
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive(self, "code_dim", "width", "steps", "codes", "directions")


@dataclass(frozen=True)
class AutoencoderRecipe:
    """Settings of the training of an autoencoder; the defaults are the recommended ones.

    Parameters
    ----------
    code_dim
        Number of values in a code.
    width
        Units of both hidden layers.
    mixtures
        Of one to four materials, that are trained on besides the materials.
    steps
        Optimizer steps.
    networks
        Networks that one step sees.
    pixels
        Pixels at which it sees them, of all pictures.
    learning_rate
        Peak of the schedule of :func:`nacre.neural.training.schedule`.
    seed
        The same seed gives the same autoencoder on the same machine.
    predictors
        Whether predictors of lobes for importance sampling are trained as well.
    """

    code_dim: int = 32
    width: int = 256
    mixtures: int = 12000
    steps: int = 8000
    networks: int = 128
    pixels: int = 96
    learning_rate: float = 2e-3
    seed: int = 0
    predictors: bool = True

    def __post_init__(self) -> None:
        check_positive(self, "code_dim", "width", "steps", "networks", "pixels")
        if self.mixtures < 0:
            raise ValueError(f"mixtures must not be negative, got {self.mixtures}")
