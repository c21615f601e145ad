"""Numbers in memory that are read several at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import require

_ALIGNMENT = 64
"""Bytes; of a line of the cache."""


def aligned_zeros(shape: tuple[int, ...], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Zeros that begin at a line of the cache.

    Dr.Jit takes the memory of NumPy's arrays as it is, and reads numbers one by one where packets
    of them may straddle: NumPy's own arrays lie by chance, and kernels over them take up to twice
    as long in some processes as in others.
    """
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + _ALIGNMENT, np.uint8)
    start = -raw.ctypes.data % _ALIGNMENT
    return raw[start : start + size].view(dtype).reshape(shape)


class Packets:
    """Packets of numbers that lie next to one another.

    Parameters
    ----------
    mi
        The `mitsuba` module with a JIT variant set.
    values
        Shape (count, size), size a power of two, of :func:`aligned_zeros`; float16, float32 or
        int32. What it holds must not change.
    """

    def __init__(self, mi: Any, values: npt.NDArray[Any]) -> None:
        tensor, self._kind = {
            "float16": (mi.TensorXf16, mi.ArrayXf16),
            "float32": (mi.TensorXf, mi.ArrayXf),
            "int32": (mi.TensorXi, mi.ArrayXi),
        }[values.dtype.name]
        self._size = values.shape[1]
        self._data = tensor(values).array

    def __getitem__(self, index: Any) -> list[Any]:
        """The numbers of some packets."""
        dr = require("drjit", "render")
        shape = (self._size, dr.width(index))
        return list(dr.gather(self._kind, self._data, index, shape=shape))
