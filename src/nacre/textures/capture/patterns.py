"""Periodic patterns that surfaces are made from.

Grids have shape (size, size), with y along the rows. The same generator of random numbers gives the
same pattern at any size, sampled more or less finely.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from nacre.array import Floats
from nacre.color import srgb_to_linear

Indices = npt.NDArray[np.int64]


def positions(size: int) -> tuple[Floats, Floats]:
    """Coordinates x and y of each point of a grid, in periods from 0 to below 1."""
    steps = np.arange(size) / size
    return np.broadcast_to(steps, (size, size)), np.broadcast_to(steps[:, None], (size, size))


def noise(
    random: np.random.Generator, size: int, frequency: float, stretch: float = 1.0
) -> npt.NDArray[np.float64]:
    """Gaussian noise of one scale, with mean 0 and variance 1; 0 where the grid is too coarse.

    The frequency is in waves per period; features are `stretch` times as long in y as in x.
    """
    reach_x = int(np.ceil(2.0 * frequency))
    reach_y = int(np.ceil(2.0 * frequency / stretch)) + 1
    fx = np.arange(-reach_x, reach_x + 1)
    fy = np.arange(-reach_y, reach_y + 1)[:, None]
    radius = np.hypot(fx, fy * stretch) / frequency
    weights = np.exp(-((radius - 0.8) ** 2) / 0.18) * (radius > 0.0)
    weights = weights * (random.normal(size=weights.shape) + 1j * random.normal(size=weights.shape))
    weights = weights / np.sqrt(0.5 * (abs(weights) ** 2).sum())
    spectrum = np.zeros((size, size), complex)
    fits = (abs(fy) < size // 2) & (abs(fx) < size // 2)
    rows, columns = np.broadcast_arrays(fy % size, fx % size)
    spectrum[rows[fits], columns[fits]] = weights[fits]
    return np.asarray(np.fft.ifft2(spectrum, norm="forward").real)


def fractal(
    random: np.random.Generator, size: int, frequency: float, octaves: int, gain: float = 0.5
) -> npt.NDArray[np.float64]:
    """Noise of `octaves` scales, each with twice the frequency and `gain` times the size."""
    weights = gain ** np.arange(octaves)
    weights = weights / np.sqrt((weights**2).sum())
    total = np.zeros((size, size))
    for octave, weight in enumerate(weights):
        total += weight * noise(random, size, frequency * 2.0**octave)
    return total


@dataclass(frozen=True, eq=False)
class Cells:
    """The Voronoi cells of points, at each point of a grid; distances are in mean spacings of
    centers.
    """

    index: Indices  # the cell of each point
    distance: Floats  # to its center
    margin: Floats  # how much farther the next center is
    offset: Floats  # from the center, shape (size, size, 2)


def cells(size: int, centres: Floats, shift: Floats | float = 0.0) -> Cells:
    """Voronoi cells of points in the unit square, shape (k, 2), which repeat with it.

    The shift, shape (size, size, 2), displaces the grid: it bends the cells' edges.
    """
    spacing = len(centres) ** -0.5
    grid = (np.stack(positions(size), -1) + shift) % 1.0
    distances, found = cKDTree(centres % 1.0, boxsize=1.0).query(grid.reshape(-1, 2), 2)
    offset = (grid.reshape(-1, 2) - centres[found[:, 0]] + 0.5) % 1.0 - 0.5
    shape = (size, size)
    return Cells(
        found[:, 0].reshape(shape),
        (distances[:, 0] / spacing).reshape(shape),
        ((distances[:, 1] - distances[:, 0]) / spacing).reshape(shape),
        (offset / spacing).reshape(*shape, 2),
    )


def scattered(random: np.random.Generator, count: int, jitter: float) -> Floats:
    """`count` x `count` points of a grid in bricks, moved by up to `jitter` of half a spacing."""
    row, column = np.divmod(np.arange(count * count), count)
    shift = 0.5 * (row % 2) if count % 2 == 0 else 0.0
    points = np.stack([column + 0.5 + shift, row + 0.5], -1)
    return np.asarray((points + jitter * random.uniform(-0.5, 0.5, points.shape)) / count % 1.0)


def lay_fibres(
    size: int, points: Floats, radius: float, owners: Indices
) -> tuple[npt.NDArray[np.float64], Indices]:
    """Heights of the uppermost round fibres at each point of the grid, seen from above, and whose
    these are; -inf and -1 where none is.

    Points along their middles are x, y and height in periods, shape (k, 3), closer than the radius;
    `owners`, shape (k,), are their fibres.
    """
    reach = int(np.ceil(radius * size))
    steps = np.arange(-reach, reach + 1)
    heights = np.full(size * size, -np.inf)
    owner = np.full(size * size, -1)
    nearest = np.floor(points[:, :2] * size).astype(int)
    for dy in steps:
        for dx in steps:
            place = nearest + np.array((dx, dy))
            apart = (place / size - points[:, :2]) ** 2
            below = radius**2 - apart.sum(-1)
            hit = np.flatnonzero(below > 0.0)
            top = points[hit, 2] + np.sqrt(below[hit])
            order = np.argsort(top, kind="stable")
            flat = (place[hit, 1] % size * size + place[hit, 0] % size)[order]
            new, ids = np.full(size * size, -np.inf), np.full(size * size, -1)
            new[flat], ids[flat] = top[order], owners[hit][order]  # the last, so the highest, stays
            higher = new > heights
            heights[higher], owner[higher] = new[higher], ids[higher]
    return heights.reshape(size, size), owner.reshape(size, size)


def linear(colors: tuple[str, ...]) -> Floats:
    """Linear RGB of sRGB colors like "#a0522d", shape (k, 3)."""
    encoded = [[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in colors]
    return srgb_to_linear(np.array(encoded) / 255.0)


def blend(colors: Floats, place: Floats) -> Floats:
    """Colors between those of a palette, shape (k, 3), at `place` from 0 (first) to 1 (last)."""
    at = np.clip(place, 0.0, 1.0) * (len(colors) - 1)
    stops = np.arange(len(colors))
    return np.stack([np.interp(at, stops, colors[:, c]) for c in range(3)], -1)


def smooth_step(low: float, high: float, x: Floats) -> Floats:
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
