"""Codes in a third of the bytes: numbers along principal axes, each a byte or half of one.

The axes are principal axes of how texels look, as far as that is linear in codes. Numbers along the
first axes have a byte each, from the texture's lowest to its highest. Those along the others, in
which texels hardly differ, have half a byte each, for :data:`REACH` standard deviations to both
sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.measured.textures.domes import BONN
from nacre.textures.codecs.codec import TexelCodec

WHOLE = 12  # axes with a byte each, or one more
REACH = 3.5

_LARGEST = 1e9
_SAMPLED = 1 << 13  # texels, about, that the axes are found from
_RIDGE = 1e-6  # times the mean: no direction of codes counts less


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

    @classmethod
    def of(cls, codes: Floats, codec: TexelCodec) -> CompactCodes:
        """The numbers closest to codes of shape (height, width, code_dim).

        Raises what :meth:`nacre.textures.codecs.TexelCodec.embedding` does.
        """
        height, width, size = codes.shape
        flat = codes.reshape(-1, size).astype(np.float64)
        mean = flat.mean(axis=0)
        flat -= mean
        onto, back = _axes(flat, mean, codec)
        places = flat @ onto
        whole = min(size, WHOLE + (size - WHOLE) % 2)
        low, high = places.min(axis=0), places.max(axis=0)
        reach = REACH * places[:, whole:].std(axis=0)
        low[whole:], high[whole:] = -reach, reach
        most = np.where(np.arange(size) < whole, 255, 15)
        step = np.maximum((high - low) / most, 1e-30)
        numbers = np.clip(np.round((places - low) / step), 0, most).astype(np.uint8)
        halves = (numbers[:, whole::2] << 4) | numbers[:, whole + 1 :: 2]
        packed = np.concatenate([numbers[:, :whole], halves], 1).reshape(height, width, -1)
        axes, center = step[:, None] * back, mean + low @ back
        return cls(packed, axes.astype(np.float32), center.astype(np.float32))


def _axes(flat: Floats, mean: Floats, codec: TexelCodec) -> tuple[Floats, Floats]:
    """Matrices from codes about their mean, (n, code_dim), to places along axes, and back."""
    size = flat.shape[1]
    sample = flat[:: max(1, len(flat) // _SAMPLED)]
    looks = codec.embedding(*BONN.pairs())(np.asarray(sample + mean, np.float32))
    slopes = np.linalg.lstsq(sample, looks - looks.mean(axis=0), rcond=None)[0]
    metric = slopes @ slopes.T
    metric += max(_RIDGE * np.trace(metric) / size, 1e-12) * np.eye(size)
    root = np.linalg.cholesky(metric)  # distances of codes @ root are those of looks
    _, turn = np.linalg.eigh(root.T @ (flat.T @ flat) @ root)
    turn = turn[:, ::-1]
    return root @ turn, turn.T @ np.linalg.inv(root)
