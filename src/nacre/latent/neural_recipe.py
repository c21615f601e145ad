"""Settings of the training of a neural basis."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BasisRecipe:
    """Settings of the training of a neural basis; the defaults are the recommended ones.

    Parameters
    ----------
    values
        k, the values of a code.
    hidden
        Widths of the hidden layers.
    steps
        Optimiser steps.
    directions
        Pairs of directions that the materials are known at.
    batch
        How many of them one step sees, of all materials.
    learning_rate
        Peak of the schedule of :func:`nacre.neural.training.schedule`.
    seed
        The same seed gives the same basis on the same machine.
    """

    values: int = 32
    hidden: tuple[int, ...] = (96, 96, 96)
    steps: int = 8000
    directions: int = 1 << 16
    batch: int = 256
    learning_rate: float = 5e-3
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("values", "steps", "directions", "batch"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        if not self.hidden or min(self.hidden) < 1:
            raise ValueError(f"hidden must be widths of layers, got {self.hidden}")

    @property
    def pairs(self) -> int:
        """p, the pairs of values for colours: as many as principal components take."""
        return max(5 * self.values // 32, min(1, self.values // 3))
