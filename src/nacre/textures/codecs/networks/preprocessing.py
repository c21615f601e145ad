"""What networks see in place of reflectance: its logarithm, with mean 0 and deviation 1."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre.array import Array, Floats, namespace
from nacre.errors import NacreError

OFFSET = 1e-2  # added to reflectance factors before the logarithm is taken
_DARKEST_DEVIATION = 1e-3  # training data that vary less are taken to vary that much
_LARGEST = 11.0
"""Logarithms are clamped here, at a reflectance factor of 60,000, about the largest half float."""


@dataclass(frozen=True)
class Whitening:
    """Logarithm of reflectance, less a mean, over a deviation (Rainer et al. 2020, section 4).

    Mean and deviation of the training data's logarithms are two numbers, not one per channel:
    training permutes the channels, so that all three have the same statistics. Values below 0,
    which are noise of a measurement, count as 0. `offset` is e in log(x + e): what is darker by far
    is noise, which should not fill the range. The paper does not name its own.

    A ValueError says that a number is not finite, or that deviation or offset is not positive.
    """

    mean: float
    deviation: float
    offset: float = OFFSET

    def __post_init__(self) -> None:
        for name in ("mean", "deviation", "offset"):
            value = getattr(self, name)
            if not math.isfinite(value) or abs(value) > 1e6:
                raise ValueError(f"{name} of the whitening must be finite, got {value}")
            if name != "mean" and value < 1e-9:
                raise ValueError(f"{name} of the whitening must be positive, got {value}")

    @classmethod
    def of(cls, parts: Iterable[Floats], offset: float = OFFSET) -> Whitening:
        """The whitening that training data ask for: reflectance factors, in arrays of any shape.

        A NacreError says that there are none.
        """
        count, total, squares = 0, 0.0, 0.0
        for part in parts:
            logs = np.log(np.maximum(part, 0.0) + np.float32(offset))
            count += logs.size
            total += float(logs.sum(dtype=np.float64))
            squares += float(np.square(logs, dtype=np.float64).sum())
        if not count:
            raise NacreError("there is no texel to train on")
        mean = total / count
        variance = max(squares / count - mean * mean, 0.0)
        return cls(mean, max(math.sqrt(variance), _DARKEST_DEVIATION), offset)

    def whiten(self, values: Array) -> Any:
        """Whitened logarithms of reflectance factors, in NumPy or PyTorch."""
        xp = namespace(values)
        return (xp.log(xp.maximum(values, 0.0) + self.offset) - self.mean) / self.deviation

    def whiten_(self, values: Array) -> Any:
        """The same for a PyTorch tensor, in its memory."""
        values.clamp_(min=0.0).add_(self.offset).log_()
        return values.sub_(self.mean).mul_(1.0 / self.deviation)

    def restore(self, whitened: Array) -> Any:
        """Reflectance factors of whitened logarithms, in any array library."""
        xp = namespace(whitened)
        logarithms = xp.minimum(whitened * self.deviation + self.mean, _LARGEST)
        return xp.maximum(xp.exp(logarithms) - self.offset, 0.0)

    def restore_(self, whitened: Array) -> Any:
        """The same for a PyTorch tensor, in its memory."""
        logarithms = whitened.mul_(self.deviation).add_(self.mean).clamp_(max=_LARGEST)
        return logarithms.exp_().sub_(self.offset).clamp_(min=0.0)
