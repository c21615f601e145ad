"""Settings of the training of lobe predictors."""

from __future__ import annotations

from dataclasses import dataclass


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
        Optimiser steps.
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
