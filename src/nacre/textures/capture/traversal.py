"""Rays through a periodic surface: a grid of heights, two triangles a cell, repeated for ever.

Lengths are in cells. Cell (i, j) reaches from (j, i) to (j + 1, i + 1) and is split along the line
from its lowest to its highest corner. Heights are continuous, so a ray that leaves a triangle below
the surface has met it inside: only the ends of its stretches are tested, and nothing leaks.
"""

from __future__ import annotations

import math
from typing import Any

from nacre.compile.numba_code import inner

_FAR = 1e30
_PERIODS = 8  # a ray that has crossed so many periods without meeting anything has left


@inner  # type: ignore[untyped-decorator]
def slopes(heights: Any, row: Any, column: Any, upper: Any) -> Any:
    """Height of the cell's first corner, and slopes in x and y of one of its triangles."""
    size = heights.shape[0]
    right = column + 1 if column + 1 < size else 0
    above = row + 1 if row + 1 < size else 0
    first, last = heights[row, column], heights[above, right]
    if upper:
        other = heights[above, column]
        return first, last - other, other - first
    other = heights[row, right]
    return first, other - first, last - other


@inner  # type: ignore[untyped-decorator]
def height_at(heights: Any, x: Any, y: Any) -> Any:
    """Height of the surface above or below any point of the plane."""
    size = heights.shape[0]
    column, row = math.floor(x), math.floor(y)
    u, v = x - column, y - row
    h, sx, sy = slopes(heights, int(row) % size, int(column) % size, v > u)
    return h + sx * u + sy * v


@inner  # type: ignore[untyped-decorator]
def intersect(
    heights: Any, tops: Any, floor: Any, peak: Any, x: Any, y: Any, z: Any, dx: Any, dy: Any,
    dz: Any,
) -> Any:  # fmt: skip
    """Where a ray meets the surface first (Amanatides and Woo 1987, in two dimensions).

    `heights` and `tops` have the heights at the corners of cells and the highest corner of each
    cell, shape (size, size); `floor` and `peak` are the lowest and highest of all. The ray, in
    cells, starts at (x, y, z), not below the surface, and goes along (dx, dy, dz). Gives the
    distance in units of the direction, negative where nothing is met; row and column of the cell;
    and whether the point is in its upper triangle.
    """
    size = heights.shape[0]
    column, row = math.floor(x), math.floor(y)
    u0, v0 = x - column, y - row
    wrapped_column, wrapped_row = int(column) % size, int(row) % size
    step_x = 1 if dx > 0.0 else -1
    step_y = 1 if dy > 0.0 else -1
    per_x = 1.0 / abs(dx) if dx != 0.0 else _FAR
    per_y = 1.0 / abs(dy) if dy != 0.0 else _FAR
    next_x = (1.0 - u0 if dx > 0.0 else u0) * per_x if dx != 0.0 else _FAR
    next_y = (1.0 - v0 if dy > 0.0 else v0) * per_y if dy != 0.0 else _FAR
    end = _FAR
    if dz != 0.0:
        end = ((floor - 1.0 if dz < 0.0 else peak) - z) / dz
    end = min(end, _PERIODS * size / max(abs(dx), abs(dy), 1e-9))
    start = 0.0
    while start < end:
        stop = min(next_x, next_y, end)
        if z + min(start * dz, stop * dz) <= tops[wrapped_row, wrapped_column]:
            ua, va = u0 + start * dx, v0 + start * dy
            ub, vb = u0 + stop * dx, v0 + stop * dy
            before, after = ua - va, ub - vb
            changes = before * after < 0.0  # the ray crosses both triangles of the cell
            upper = before < 0.0 if changes else before + after < 0.0
            h, sx, sy = slopes(heights, wrapped_row, wrapped_column, upper)
            gap_a = max(0.0, z + start * dz - h - sx * ua - sy * va)
            first = start
            if changes:
                middle = start + (stop - start) * before / (before - after)
                um = u0 + middle * dx
                gap_b = z + middle * dz - h - (sx + sy) * um
                if gap_b < 0.0:
                    t = start + (middle - start) * gap_a / (gap_a - gap_b)
                    return t, wrapped_row, wrapped_column, upper
                upper = not upper
                h, sx, sy = slopes(heights, wrapped_row, wrapped_column, upper)
                gap_a, first = gap_b, middle
            gap_b = z + stop * dz - h - sx * ub - sy * vb
            if gap_b < 0.0:
                t = first + (stop - first) * gap_a / (gap_a - gap_b)
                return t, wrapped_row, wrapped_column, upper
        start = stop
        if next_x <= next_y:
            next_x += per_x
            u0 -= step_x
            wrapped_column += step_x
            wrapped_column = wrapped_column - size if wrapped_column >= size else wrapped_column
            wrapped_column = wrapped_column + size if wrapped_column < 0 else wrapped_column
        else:
            next_y += per_y
            v0 -= step_y
            wrapped_row += step_y
            wrapped_row = wrapped_row - size if wrapped_row >= size else wrapped_row
            wrapped_row = wrapped_row + size if wrapped_row < 0 else wrapped_row
    return -1.0, 0, 0, False
