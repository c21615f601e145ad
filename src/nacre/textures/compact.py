"""Codes as files of nacre 0.2 may hold them: numbers along axes, each a byte or half of one.

They are read only; :mod:`nacre.textures.rates` writes fewer bytes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats

_LARGEST = 1e9


@dataclass(frozen=True, eq=False)
class CompactCodes:
    """A map of codes in few bytes; a ValueError says that shapes or types do not fit.

    Numbers along the first axes come first, then pairs of those along the others, the first of a
    pair in the upper half of a byte.
    """

    numbers: npt.NDArray[np.uint8]  # shape (height, width, b)
    axes: Floats  # what a step along each axis adds to a code, shape (code_dim, code_dim)
    center: Floats  # the code of all zeros, shape (code_dim,)

    def __post_init__(self) -> None:
        shape, size = self.numbers.shape, len(self.center)
        if self.numbers.dtype != np.uint8 or len(shape) != 3 or 0 in shape:
            raise ValueError(f"compact codes are {self.numbers.dtype} {shape}")
        if self.center.shape != (size,) or self.axes.shape != (size, size):
            raise ValueError(f"axes are {self.axes.shape} about {self.center.shape}")
        if not shape[2] <= size <= 2 * shape[2]:
            raise ValueError(f"codes of {size} values in {shape[2]} bytes")
        for array in (self.axes, self.center):
            if array.dtype != np.float32 or not np.abs(array).max() <= _LARGEST:
                raise ValueError(f"axes of codes are not float32 numbers up to {_LARGEST:g}")

    @property
    def codes(self) -> npt.NDArray[np.float32]:
        """The codes that the numbers stand for, shape (height, width, code_dim)."""
        whole = 2 * self.numbers.shape[2] - len(self.center)
        pairs = self.numbers[..., whole:]
        halves = np.stack([pairs >> 4, pairs & 15], -1).reshape(*pairs.shape[:2], -1)
        numbers = np.concatenate([self.numbers[..., :whole], halves], -1).astype(np.float32)
        return np.asarray(self.center + numbers @ self.axes, np.float32)
