"""How errors of an animation change from frame to frame: what is seen as flicker."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.errors import NacreError


@dataclass(frozen=True)
class TemporalErrors:
    """Means over pixels and channels of two animations with the same frames."""

    mse: float  # squared difference, over frames too
    variance: float  # of the difference over frames: the part of `mse` that does not stand still
    truth_steps: float  # squared change from each frame to the next: of the truth,
    other_steps: float  # of the other,
    error_steps: float  # of the difference


def temporal_errors(frames: Iterable[tuple[Floats, Floats]]) -> TemporalErrors:
    """Compare two animations as they are shown, clipped to [0, 1], in the memory of a few frames.

    Frames are pairs of the truth and the other, linear, of shape (height, width, 3). Raises
    NacreError if there is no frame.
    """
    count = 0
    mse = variance = 0.0
    steps = np.zeros(3)
    mean: Floats = np.zeros(())
    before: tuple[Floats, ...] = ()
    for pair in frames:
        truth, other = (np.clip(np.asarray(picture, np.float32), 0.0, 1.0) for picture in pair)
        error = other - truth
        shown = truth, other, error
        if count:
            steps += [_mean(np.square(a - b)) for a, b in zip(shown, before, strict=True)]
        before = shown
        count += 1
        # Welford's update: no large sums are subtracted
        change = error - mean
        mean = mean + change / count
        mse += _mean(np.square(error))
        variance += _mean(change * (error - mean))
    if not count:
        raise NacreError("there is no frame to compare")
    return TemporalErrors(mse / count, variance / count, *map(float, steps / max(count - 1, 1)))


def _mean(values: Floats) -> float:
    return float(values.mean(dtype=np.float64))
