"""An environment as a fixed set of directions and weights."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from nacre.color import luminance
from nacre.render.environment import Environment, pixel_directions, row_edges

Floats = npt.NDArray[np.floating]

_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def golden_lattice(count: int) -> tuple[Floats, Floats]:
    """Evenly spread points of the unit square: a rank-1 lattice of the golden ratio.

    Returns
    -------
    u, v
        (k + 1/2) / count and frac((k + 1/2) / golden ratio), in [0, 1), shapes (count,).
    """
    index = np.arange(count) + 0.5
    return index / max(count, 1), np.modf(index * _GOLDEN)[0]


def quadrature(environment: Environment, count: int) -> tuple[Floats, Floats]:
    """Light directions and weights whose sums stand for integrals over the environment.

    For any function f of direction, the integral of f times radiance over the sphere is about
    `(f(directions) * weights).sum(0)`. Directions are drawn in proportion to luminance, by
    inverting its cumulative distribution over the pixels at :func:`golden_lattice`. Nothing is
    random: the same map and count give the same directions. The map counts as constant within a
    pixel, so every weight has the same luminance.

    Parameters
    ----------
    environment
        The map.
    count
        Number of directions, at least 1.

    Returns
    -------
    directions
        Unit vectors toward the light, shape (count, 3), float32.
    weights
        Radiance times solid angle, linear RGB, shape (count, 3), float32.
    """
    if count < 1:
        raise ValueError(f"a quadrature needs at least one direction, got {count}")
    pixels = environment.pixels.astype(np.float64)
    height, width, _ = pixels.shape
    _, solid_angles = pixel_directions(height, width)
    value = luminance(tuple(np.moveaxis(pixels, -1, 0)))
    power = value * solid_angles[:, None]
    u, v = golden_lattice(count)

    row, down = _invert(np.cumsum(power.sum(axis=1)), u)
    columns = np.cumsum(power, axis=1)
    column, across = np.empty(count, int), np.empty(count)
    for j in np.unique(row):
        chosen = row == j
        column[chosen], across[chosen] = _invert(columns[j], v[chosen])

    edges = row_edges(height)
    y = edges[row] + down * (edges[row + 1] - edges[row])
    radius, phi = np.sqrt(1.0 - y * y), (column + across) * (2.0 * math.pi / width)
    directions = np.stack([radius * np.sin(phi), y, -radius * np.cos(phi)], axis=-1)
    weights = pixels[row, column] / value[row, column, None] * (power.sum() / count)
    return directions.astype(np.float32), weights.astype(np.float32)


def _invert(cumulative: Floats, u: Floats) -> tuple[npt.NDArray[np.int_], Floats]:
    """Bin in which a fraction `u` of the total lies, and where within the bin, in [0, 1)."""
    target = u * cumulative[-1]
    index = np.minimum(np.searchsorted(cumulative, target, side="right"), len(cumulative) - 1)
    start = np.where(index > 0, cumulative[index - 1], 0.0)
    return index, (target - start) / (cumulative[index] - start)
