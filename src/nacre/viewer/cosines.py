"""Functions on a grid of four axes as rounded cosines, and texels of a pyramid as differences.

Both are for numbers that compress: functions of light and view vary slowly, so that few cosines of
high frequency are not zero; a coarser level is close to means of the one before.
`page/cosines.js` undoes both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats

LARGEST = 2**15 - 1
"""Largest magnitude of a rounded cosine."""


@dataclass(frozen=True, eq=False)
class Cosines:
    """Functions at the nodes of a grid, as whole multiples of a step each.

    Parameters
    ----------
    values
        Coefficients of the orthonormal discrete cosine transform along all axes, over the step;
        shape (k, size, size, size, size).
    step
        Of each function, shape (k,).
    """

    values: npt.NDArray[np.int16]
    step: Floats

    @classmethod
    def of(cls, functions: Floats, step: npt.NDArray[np.floating]) -> Cosines:
        """Functions at nodes, shape (size^4, k), with steps of at least `step`, shape (k,)."""
        from scipy.fft import dctn

        size = round(len(functions) ** 0.25)
        grid = functions.T.reshape(-1, *(size,) * 4).astype(np.float64)
        found = dctn(grid, axes=(1, 2, 3, 4), norm="ortho")
        most = np.abs(found).max(axis=(1, 2, 3, 4))
        steps = np.maximum(step, most / LARGEST).astype(np.float32)
        scaled = np.round(found / steps[:, None, None, None, None])
        return cls(np.clip(scaled, -LARGEST, LARGEST).astype(np.int16), steps)

    @property
    def numbers(self) -> Floats:
        """The functions that they stand for, shape (size^4, k)."""
        from scipy.fft import idctn

        scaled = self.values * self.step[:, None, None, None, None].astype(np.float64)
        found = idctn(scaled, axes=(1, 2, 3, 4), norm="ortho")
        return np.ascontiguousarray(found.reshape(len(found), -1).T, np.float32)

    def tobytes(self) -> bytes:
        """Function by function, low frequencies first; low bytes, then high bytes.

        Frequencies are ordered by the sum of their four indices. Numbers n >= 0 become 2 n and
        others -2 n - 1, so that small ones have no high byte.
        """
        size = self.values.shape[1]
        order = np.argsort(np.indices((size,) * 4).sum(axis=0).ravel(), kind="stable")
        ordered = self.values.reshape(len(self.values), -1)[:, order]
        folded = ((ordered << 1) ^ (ordered >> 15)).astype(np.uint16)
        return b"".join(part.astype(np.uint8).tobytes() for part in (folded & 255, folded >> 8))


def differences(
    levels: npt.NDArray[np.uint8], shapes: Sequence[tuple[int, int]]
) -> npt.NDArray[np.uint8]:
    """Bytes of all levels of a pyramid, shape (k, t); after the first less a mean, modulo 256.

    `shapes` are heights and widths of the levels, whose texels follow one another in t. The mean,
    rounded, is that of two by two texels of the level before; where an edge has one only, it counts
    twice.
    """
    found, start = levels.copy(), 0
    before: npt.NDArray[np.int64] | None = None
    for height, width in shapes:
        part = slice(start, start + height * width)
        level = levels[:, part].reshape(-1, height, width).astype(np.int64)
        if before is not None:
            rows, columns = (
                np.minimum(2 * np.arange(count)[:, None] + (0, 1), size - 1)
                for count, size in zip((height, width), before.shape[1:], strict=True)
            )
            four = before[:, rows[:, None, :, None], columns[None, :, None, :]]
            mean = (four.sum(axis=(3, 4)) + 2) >> 2
            found[:, part] = ((level - mean) & 255).reshape(len(found), -1)
        before, start = level, part.stop
    return found
