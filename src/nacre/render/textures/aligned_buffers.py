"""Numbers in memory that are read several at a time."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from nacre.errors import require


class Packets:
    """Packets of numbers that lie next to one another.

    Parameters
    ----------
    mi
        The `mitsuba` module with a JIT variant set.
    values
        Shape (count, size), size a power of two, of :func:`nacre.array.aligned_zeros`; float16,
        float32 or int32. What it holds must not change.
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
