"""An environment in cells of equal light, from which directions are drawn exactly.

Cells come from the median cut (Debevec 2005, "A Median Cut Algorithm for Light Probe Sampling"):
the rectangle of pixels with the most light is cut into halves of equal light, again and again.
Within a cell a pixel is drawn by Walker's alias method, in constant time, and a direction
uniformly within the pixel. A pixel's chance is its mean luminance with its neighbors', so that
light that is interpolated between pixels has density wherever it is not zero.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Doubles, Table, namespace
from nacre.color import luminance
from nacre.mitsuba.environment import Environment, pixel_directions, row_edges

_FLOOR = 1e-3  # of the map's mean luminance: what every pixel has at least
_THINNEST = 0.05  # of the equator's: the least length of a row, so that poles are cut along too


class Rectangle(NamedTuple):
    """Pixels of a map."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def pixels(self) -> tuple[slice, slice]:
        return slice(self.top, self.bottom), slice(self.left, self.right)


class LightCells:
    """Rectangles of a map's pixels, each with about the same light.

    Methods on components take arrays of any library of :mod:`nacre.array`; a cell is a flat index.

    Parameters
    ----------
    environment
        The light.
    count
        How many cells, from 1 to the number of pixels. Raises ValueError for others.
    """

    def __init__(self, environment: Environment, count: int = 1) -> None:
        height, width, _ = environment.pixels.shape
        if not 1 <= count <= height * width:
            raise ValueError(f"a map of {height} x {width} pixels has no {count} cells")
        self._height, self._width = height, width
        channels = np.moveaxis(environment.pixels.astype(float), -1, 0)
        light = _smoothed(luminance((channels[0], channels[1], channels[2])))
        light = np.maximum(light, _FLOOR * light.mean())
        directions, solid_angle = pixel_directions(height, width)
        energy = light * solid_angle[:, None]
        rectangles = _median_cut(energy, count)
        owner = np.empty((height, width), int)
        for index, rectangle in enumerate(rectangles):
            owner[rectangle.pixels] = index
        self.energies: Doubles = np.array([energy[r.pixels].sum() for r in rectangles])
        """Light of each cell, shape (count,): luminance times sr."""
        middles = np.stack(
            [(directions * energy[..., None])[r.pixels].sum((0, 1)) for r in rectangles]
        )
        self.middles: Doubles = middles / np.linalg.norm(middles, axis=1, keepdims=True)
        """Mean directions of the cells' light, unit vectors of shape (count, 3)."""
        sizes = [(r.bottom - r.top) * (r.right - r.left) for r in rectangles]
        self._first, self._size = Table(np.cumsum([0, *sizes[:-1]])), Table(sizes)
        numbers = np.arange(height * width).reshape(height, width)
        chances, pixels, others = [], [], []
        for rectangle in rectangles:
            own = numbers[rectangle.pixels].ravel()
            chance, alias = _alias(energy[rectangle.pixels].ravel())
            chances.append(chance)
            pixels.append(own)
            others.append(own[alias])
        self._chance, self._pixel, self._other = (
            Table(np.concatenate(parts)) for parts in (chances, pixels, others)
        )
        self._owner = Table(owner)
        self._density = Table(light / self.energies[owner])
        self._edges = Table(row_edges(height))

    def sample_components(self, cell: Array, u: tuple[Array, Array, Array, Array]) -> Components:
        """A direction to the light in a cell, from four numbers in [0, 1)."""
        xp = namespace(*u)
        size = xp.take(self._size, cell)
        slot = xp.take(self._first, cell) + xp.minimum(xp.floor(u[0] * size), size - 1.0)
        slot = xp.to_index(slot)
        kept = u[1] < xp.take(self._chance, slot)
        pixel = xp.where(kept, xp.take(self._pixel, slot), xp.take(self._other, slot))
        row = xp.floor((pixel + 0.5) * (1.0 / self._width))
        column = pixel - row * self._width
        at = xp.to_index(row)
        upper, lower = xp.take(self._edges, at), xp.take(self._edges, at + 1)
        y = upper + u[2] * (lower - upper)
        radius = xp.sqrt(xp.maximum(1.0 - y * y, 0.0))
        phi = (column + u[3]) * (2.0 * math.pi / self._width)
        return radius * xp.sin(phi), y, -1.0 * radius * xp.cos(phi)

    def at_components(self, w: Components) -> tuple[Array, Array]:
        """The cell of a direction to the light, and its density in that cell in 1/sr."""
        xp = namespace(*w)
        # The pole's cosine has no digits to tell rows apart by; its sine does.
        radius = xp.sqrt(w[0] * w[0] + w[2] * w[2])
        row = xp.floor(xp.arctan2(radius, w[1]) * ((self._height - 1) / math.pi) + 0.5)
        row = xp.minimum(xp.maximum(row, 0.0), self._height - 1.0)
        turn = xp.arctan2(w[0], -1.0 * w[2]) * (1.0 / (2.0 * math.pi))
        column = xp.floor((turn - xp.floor(turn)) * self._width)
        pixel = xp.to_index(row * self._width + xp.minimum(column, self._width - 1.0))
        return xp.to_index(xp.take(self._owner, pixel)), xp.take(self._density, pixel)


def _smoothed(values: Doubles) -> Doubles:
    """Means of 3 x 3 pixels of a latitude-longitude map."""
    rows = np.pad(values, ((1, 1), (0, 0)), mode="edge")
    rows = rows[:-2] + rows[1:-1] + rows[2:]
    return np.asarray((np.roll(rows, 1, 1) + rows + np.roll(rows, -1, 1)) / 9.0)


def _median_cut(energy: Doubles, count: int) -> list[Rectangle]:
    """Rectangles that cover a map, shape (height, width); the one with the most light is cut."""
    height, width = energy.shape
    waiting = [(-math.inf, Rectangle(0, height, 0, width))]
    while len(waiting) < count:
        _, (top, bottom, left, right) = heapq.heappop(waiting)
        middle = math.sin((top + bottom) * math.pi / (2 * height))
        long = (right - left) * 2.0 * height / width * max(middle, _THINNEST)
        light = energy[top:bottom, left:right]
        if right - left == 1 or (bottom - top >= long and bottom - top > 1):
            cut = top + _half(light.sum(1))
            halves = Rectangle(top, cut, left, right), Rectangle(cut, bottom, left, right)
        else:
            cut = left + _half(light.sum(0))
            halves = Rectangle(top, bottom, left, cut), Rectangle(top, bottom, cut, right)
        for half in halves:
            one = half.bottom - half.top == half.right - half.left == 1
            heapq.heappush(waiting, (0.0 if one else -energy[half.pixels].sum(), half))
    return [rectangle for _, rectangle in waiting]


def _half(light: Doubles) -> int:
    """After how many of two or more values half of their sum is reached, leaving some on a side."""
    sums = np.cumsum(light)
    return int(np.clip(np.searchsorted(sums, 0.5 * sums[-1]) + 1, 1, len(light) - 1))


def _alias(weights: Doubles) -> tuple[Doubles, npt.NDArray[np.intp]]:
    """Walker's alias method: the chance to keep each index, and what else to take."""
    chance = weights * (len(weights) / weights.sum())
    alias = np.arange(len(weights))
    poor, rich = list(np.flatnonzero(chance < 1.0)), list(np.flatnonzero(chance >= 1.0))
    while poor and rich:
        small, large = poor.pop(), rich[-1]
        alias[small] = large
        chance[large] -= 1.0 - chance[small]
        if chance[large] < 1.0:
            poor.append(rich.pop())
    for rest in (*poor, *rich):  # rounding leaves these a little off 1
        chance[rest] = 1.0
    return chance, alias
