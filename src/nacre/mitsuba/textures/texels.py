"""Which texels contribute to a point of a texture, and the data that is kept for each of them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, aligned_zeros
from nacre.errors import require
from nacre.io.tensors import HALF_LARGEST
from nacre.mitsuba.textures.placement import Footprint

INTERPOLATIONS = "stochastic", "linear", "nearest"

Corners: TypeAlias = "list[tuple[Any, Any]]"
"""Indices of texels or nodes, and weights that add up to 1."""

_ROW = 16  # numbers that are read together


class TexelGrid:
    """Texels around points of a texture that repeats.

    As in Mitsuba's bitmaps, texel (0, 0) covers u and v from 0 to 1 / width and 1 / height.

    Parameters
    ----------
    interpolation
        "linear": the four texels around a point. "stochastic": one of them, with its weight as
        probability, so that the mean over many points is linear interpolation (Pharr, Wronski,
        Salvi and Fajardo 2024, "Filtering After Shading With Stochastic Texture Filtering"); the
        same point always has the same texel. "nearest": the texel that contains the point.
    levels
        Heights and widths of a pyramid for :meth:`seen`, starting with the map; records of each
        level follow those of the one before.
    """

    def __init__(
        self,
        mi: Any,
        height: int,
        width: int,
        interpolation: str,
        levels: Sequence[tuple[int, int]] | None = None,
    ) -> None:
        self._mi, self.height, self.width = mi, height, width
        self._interpolation = interpolation
        if levels is not None:
            shapes = np.array(levels, np.uint32)
            starts = np.cumsum([0, *shapes.prod(1)[:-1]])
            self._levels = [mi.UInt32(column) for column in (*shapes.T, starts)]

    def seen(self, uv: Any, footprint: Footprint) -> Corners:
        """Texels that pixels see around points, on levels where one texel covers what a pixel sees.

        In stochastic mode one texel is chosen: at some point along the longer side, on a level
        whose texels are as wide as the shorter side. Otherwise texels are as wide as the longer
        side.
        """
        mi, dr = self._mi, require("drjit", "render")
        last = dr.width(self._levels[0]) - 1
        chance = self._interpolation == "stochastic"
        level = dr.clip(dr.log2(dr.maximum(footprint.texels[int(chance)], 1.0)), 0.0, float(last))
        if chance:
            place, fraction = jitters(mi, (uv.y, uv.x), 2)
            floor = mi.UInt32(dr.minimum(dr.floor(level + fraction), float(last)))
            return self._around(uv + footprint.long * (place - 0.5), floor)
        floor = mi.UInt32(dr.minimum(dr.floor(level), float(last)))
        fraction = level - mi.Float(floor)
        return [
            (index, weight * part)
            for which, part in ((floor, 1.0 - fraction), (dr.minimum(floor + 1, last), fraction))
            for index, weight in self._around(uv, which)
        ]

    def around(self, uv: Any) -> Corners:
        """Texels of points, `mi.Point2f`, as indices y * width + x."""
        return self._around(uv, None)

    def _around(self, uv: Any, level: Any) -> Corners:
        mi, dr = self._mi, require("drjit", "render")
        height, width, start = self.height, self.width, 0
        if level is not None:
            height, width, start = (dr.gather(mi.UInt32, v, level) for v in self._levels)
        inside = uv - dr.floor(uv)
        x, y = inside.x * width - 0.5, inside.y * height - 0.5
        if self._interpolation == "linear":
            corners = []
            for dy, dx in itertools.product((0, 1), repeat=2):
                (column, right), (row, below) = (
                    (mi.Int32(dr.floor(v)) + d, v - dr.floor(v)) for v, d in ((x, dx), (y, dy))
                )
                weight = (right if dx else 1.0 - right) * (below if dy else 1.0 - below)
                corners.append((_index(mi, column, row, height, width) + start, weight))
            return corners
        jitter = mi.Point2f(0.5)
        if self._interpolation == "stochastic":
            jitter = mi.Point2f(*jitters(mi, (uv.x, uv.y), 2))
        columns, rows = mi.Int32(dr.floor(x + jitter.x)), mi.Int32(dr.floor(y + jitter.y))
        return [(_index(mi, columns, rows, height, width) + start, mi.Float(1.0))]


def _index(mi: Any, column: Any, row: Any, height: Any, width: Any) -> Any:
    """Indices of texels up to one beyond the edges, where the texture repeats."""
    dr = require("drjit", "render")
    wide, high = mi.Int32(width), mi.Int32(height)
    column, row = (
        dr.select(i < 0, i + size, dr.select(i >= size, i - size, i))
        for i, size in ((column, wide), (row, high))
    )
    return mi.UInt32(row * wide + column)


def jitters(mi: Any, numbers: tuple[Any, ...], count: int) -> list[Any]:
    """Random numbers in (0, 1) with 32 / `count` bits each, determined by two to four floats."""
    dr = require("drjit", "render")
    bits = [dr.reinterpret_array(mi.UInt32, mi.Float(number)) for number in numbers]
    words = [bits[0], bits[1]]
    for index, more in enumerate(bits[2:]):
        words[index] = words[index] * 0x9E3779B1 + more
    scattered, _ = mi.sample_tea_32(words[0], words[1], 4)
    width = 32 // count
    mask = (1 << width) - 1
    return [
        (mi.Float((scattered >> (width * k)) & mask) + 0.5) * (1.0 / (1 << width))
        for k in range(count)
    ]


class Records:
    """Numbers for each texel or node that are read together, from values (count, numbers).

    They are stored in half precision if asked for and if it can hold them.
    """

    def __init__(self, mi: Any, values: Floats, half: bool) -> None:
        self._mi = mi
        count, self.numbers = values.shape
        self._rows, row = _rows(self.numbers)
        half = half and float(np.abs(values).max()) < HALF_LARGEST
        dtype: npt.DTypeLike = np.float16 if half else np.float32
        padded = aligned_zeros((count, self._rows * row), dtype)
        padded[:, : self.numbers] = values
        self._data = AlignedBuffer(mi, padded.reshape(-1, row))

    def at(self, corners: Corners) -> list[Any]:
        """Weighted sums of the numbers of some records."""
        if len(corners) == 1:
            return self[corners[0][0]]
        dr = require("drjit", "render")
        total: list[Any] = [self._mi.Float(0.0)] * self.numbers
        for index, weight in corners:
            terms = zip(self[index], total, strict=True)
            total = [dr.fma(value, weight, sum_) for value, sum_ in terms]
        return total

    def __getitem__(self, index: Any) -> list[Any]:
        rows = [self._data[index * self._rows + k] for k in range(self._rows)]
        return [self._mi.Float(v) for row in rows for v in row][: self.numbers]


def record_bytes(numbers: int, half: bool) -> int:
    """Memory that a record takes."""
    rows, row = _rows(numbers)
    return rows * row * (2 if half else 4)


def _rows(numbers: int) -> tuple[int, int]:
    """The number of rows in a record, and of numbers in a row."""
    row = min(_ROW, 1 << (numbers - 1).bit_length())
    return -(-numbers // row), row


class AlignedBuffer:
    """Rows of numbers that a kernel reads one row at a time.

    Values have shape (count, size), size a power of two, and come from
    :func:`nacre.array.aligned_zeros`: float16, float32 or int32. They must not change later.
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
        dr = require("drjit", "render")
        shape = (self._size, dr.width(index))
        return list(dr.gather(self._kind, self._data, index, shape=shape))
