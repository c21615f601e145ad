"""Bilinear functions on the unit square that depend on parameters, and their inverse CDFs.

A table holds one *slice* of `height` x `width` values per node of a parameter grid. Between nodes
of the square a slice is bilinear; between nodes of the parameter grid slices are blended linearly.
:class:`Warp` maps uniform points to points of that density and back: a marginal over rows, then a
conditional along a row, both inverted in closed form because a piecewise linear density has a
piecewise quadratic integral (Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient
Material Acquisition and Rendering", section 3).

Everything but the constructors runs on components of any array library.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Table, namespace
from nacre.measured.axis import Blend, bisect, zero_index

_TINY = 1e-37  # least divisor: keeps rows without any density from dividing 0 by 0 in float32
_MIN_UNIFORM = 2.0**-24  # in place of 0, which would choose a cell without density if one is first


class Patch(NamedTuple):
    """Lower corner and position within a cell of the square."""

    column: Array
    row: Array
    x: Array
    y: Array


class Grid:
    """Bilinear functions on the unit square, blended over slices.

    Values have shape (slices, height, width), height and width at least 2; nodes include the
    borders.
    """

    def __init__(self, values: npt.NDArray[np.floating]) -> None:
        self.values = Table(values)
        self.height, self.width = values.shape[1:]

    def locate(self, x: Array, y: Array) -> Patch:
        """Cell of a point; points outside the square are moved onto its border."""
        xp = namespace(x, y)
        x = xp.minimum(xp.maximum(x, 0.0), 1.0) * (self.width - 1)
        y = xp.minimum(xp.maximum(y, 0.0), 1.0) * (self.height - 1)
        # A direction that is not a number makes an index that is not one either: keep it inside.
        column = xp.maximum(xp.minimum(xp.to_index(x), self.width - 2), 0)
        row = xp.maximum(xp.minimum(xp.to_index(y), self.height - 2), 0)
        return Patch(column, row, x - xp.to_float(column, x), y - xp.to_float(row, y))

    def corners(self, patch: Patch, blend: Blend) -> tuple[Array, Array, Array, Array]:
        """Blended values at (x0, y0), (x1, y0), (x0, y1), (x1, y1) of a cell."""
        xp = namespace(patch.column)
        cell = patch.row * self.width + patch.column
        totals: list[Array] = [0.0] * 4
        for index, weight in blend:
            first = index * (self.height * self.width) + cell
            for corner, offset in enumerate((0, 1, self.width, self.width + 1)):
                totals[corner] = totals[corner] + weight * xp.take(self.values, first + offset)
        return totals[0], totals[1], totals[2], totals[3]

    def at(self, patch: Patch, blend: Blend) -> Array:
        v00, v10, v01, v11 = self.corners(patch, blend)
        return _mix(_mix(v00, v10, patch.x), _mix(v01, v11, patch.x), patch.y)

    def nodes(self, patch: Patch) -> Blend:
        """Flat indices and weights of the nodes that :meth:`at` interpolates a slice from."""
        cell = patch.row * self.width + patch.column
        x, y = patch.x, patch.y
        return [
            (cell, (1.0 - x) * (1.0 - y)),
            (cell + 1, x * (1.0 - y)),
            (cell + self.width, (1.0 - x) * y),
            (cell + self.width + 1, x * y),
        ]

    def eval(self, x: Array, y: Array, blend: Blend) -> Array:
        return self.at(self.locate(x, y), blend)


class Warp(Grid):
    """Densities on the unit square with sampling and its inverse.

    Values, shape (slices, height, width), are non-negative, and each slice has a positive integral;
    every slice is scaled to integrate to 1.
    """

    def __init__(self, values: npt.NDArray[np.floating]) -> None:
        exact = np.asarray(values, np.float64)
        along_x = _integrals(exact, axis=2)
        along_y = _integrals(along_x[:, :, -1], axis=1)
        total = along_y[:, -1]
        super().__init__(exact / total[:, None, None])
        self._rows = Table(along_y / total[:, None])
        self._columns = Table(along_x / total[:, None, None])

    def sample(self, u: Array, v: Array, blend: Blend) -> tuple[Array, Array, Array]:
        """Point (x, y) from uniform u, along a row, and v, which chooses it; and its density."""
        xp = namespace(u, v)
        u, v = xp.maximum(u, _MIN_UNIFORM), xp.maximum(v, _MIN_UNIFORM)
        zero = zero_index(v)
        row = bisect(lambda i: self._row_integral(i, blend), v, zero, self.height - 1)
        low, high = self._integrals_at(row, self.width - 1, blend)
        y = _solve(v - self._row_integral(row, blend), low, high, self.height - 1)
        target = u * _mix(low, high, y)
        column = bisect(lambda i: self._partial(row, i, y, blend), target, zero, self.width - 1)
        v00, v10, v01, v11 = self.corners(Patch(column, row, 0.0, y), blend)
        left, right = _mix(v00, v01, y), _mix(v10, v11, y)
        x = _solve(target - self._partial(row, column, y, blend), left, right, self.width - 1)
        return (
            (xp.to_float(column, x) + x) / (self.width - 1),
            (xp.to_float(row, y) + y) / (self.height - 1),
            _mix(left, right, x),
        )

    def invert(self, x: Array, y: Array, blend: Blend) -> tuple[Array, Array, Array]:
        """Uniform (u, v) that :meth:`sample` maps to (x, y), u = 0 in an empty row, and the
        density.
        """
        patch = self.locate(x, y)
        xp = namespace(patch.x)
        v00, v10, v01, v11 = self.corners(patch, blend)
        left, right = _mix(v00, v01, patch.y), _mix(v10, v11, patch.y)
        low, high = self._integrals_at(patch.row, self.width - 1, blend)
        u = self._partial(patch.row, patch.column, patch.y, blend)
        u = u + _integral(patch.x, left, right, self.width - 1)
        v = self._row_integral(patch.row, blend)
        v = v + _integral(patch.y, low, high, self.height - 1)
        u = u / xp.maximum(_mix(low, high, patch.y), _TINY)
        return u, v, _mix(left, right, patch.x)

    def _row_integral(self, row: Array, blend: Blend) -> Array:
        """Integral over all rows up to node `row`."""
        xp = namespace(row)
        return sum(w * xp.take(self._rows, i * self.height + row) for i, w in blend)

    def _partial(self, row: Array, column: Array, y: Array, blend: Blend) -> Array:
        """Integral along a line at `y` within cell row `row`, up to node `column`."""
        return _mix(*self._integrals_at(row, column, blend), y)

    def _integrals_at(self, row: Array, column: Array, blend: Blend) -> tuple[Array, Array]:
        """Integrals along node row `row` and the next, up to node `column`."""
        xp = namespace(row)
        low = high = 0.0
        for index, weight in blend:
            first = (index * self.height + row) * self.width + column
            low = low + weight * xp.take(self._columns, first)
            high = high + weight * xp.take(self._columns, first + self.width)
        return low, high


def _integrals(values: npt.NDArray[np.float64], axis: int) -> npt.NDArray[np.float64]:
    """Running integral along an axis of [0, 1], from 0 at the first node (trapezoids: exact)."""
    values = np.moveaxis(values, axis, -1)
    steps = (values[..., 1:] + values[..., :-1]) / (2.0 * (values.shape[-1] - 1))
    sums = np.concatenate([np.zeros_like(steps[..., :1]), np.cumsum(steps, axis=-1)], axis=-1)
    return np.moveaxis(sums, -1, axis)


def _mix(a: Array, b: Array, t: Array) -> Array:
    return a + t * (b - a)


def _integral(t: Array, start: Array, end: Array, count: int) -> Array:
    """Integral from 0 to `t` over one of `count` segments, linear from `start` to `end`."""
    return t * (start + 0.5 * t * (end - start)) / count


def _solve(area: Array, start: Array, end: Array, count: int) -> Array:
    """Where in [0, 1] the integral over one segment is `area`, without cancellation."""
    xp = namespace(area)
    area = 2.0 * count * xp.maximum(area, 0.0)
    root = xp.sqrt(xp.maximum(start * start + area * (end - start), 0.0))
    return xp.minimum(area / xp.maximum(start + root, _TINY), 1.0)
