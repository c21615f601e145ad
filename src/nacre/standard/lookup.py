"""Tables on regular grids, read as renderers do: linearly along every axis."""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np

from nacre.array import Array, Table, Weights, namespace


def interpolate(table: Table, *coordinates: Array) -> Array:
    """The value of a table between its nodes, constant beyond its ends.

    The table has an axis of at least 2 nodes for each coordinate, with the last axis fastest; a
    coordinate is 0 at the first node and 1 at the last. Axes with plain numbers as coordinates are
    read once, in NumPy: for a material with constant parameters this leaves a curve. In compiled
    code and exports that is a sum of ramps, which languages without arrays can write, too.
    """
    plain = tuple((k, c) for k, c in enumerate(coordinates) if type(c) in (float, int))
    if plain:
        table = _sliced(table, plain)
    if len(plain) == len(coordinates):
        return table.values.item()
    others = [c for c in coordinates if type(c) not in (float, int)]
    xp = namespace(*others)
    if xp.library == "trace" and len(others) == 1:
        return _ramps(table.values, others[0])
    places = []
    for coordinate, size in zip(others, table.values.shape, strict=True):
        scaled = xp.minimum(xp.maximum(coordinate, 0.0), 1.0) * (size - 1.0)
        node = xp.minimum(xp.floor(scaled), size - 2.0)
        places.append((node, scaled - node, size))
    total: Array = 0.0
    for corner in itertools.product((0, 1), repeat=len(places)):
        flat: Array = 0.0
        weight: Array = 1.0
        for (node, fraction, size), side in zip(places, corner, strict=True):
            flat = flat * float(size) + (node + float(side))
            weight = weight * (fraction if side else 1.0 - fraction)
        total = total + weight * xp.take(table, xp.to_index(flat))
    return total


def _ramps(values: Weights, coordinate: Array) -> Array:
    """A piecewise linear curve, as the sum of the changes of its slope from each node on."""
    xp = namespace(coordinate)
    last = len(values) - 1
    scaled = xp.minimum(xp.maximum(coordinate, 0.0), 1.0) * float(last)
    slopes = np.diff(values.astype(np.float64))
    total = values.item(0) + slopes.item(0) * scaled
    for node, change in enumerate(np.diff(slopes).tolist(), 1):
        total = total + change * xp.maximum(scaled - float(node), 0.0)
    return total


@lru_cache(maxsize=256)
def _sliced(table: Table, plain: tuple[tuple[int, float], ...]) -> Table:
    """The rest of a table at fixed coordinates along some axes."""
    found = table.values.astype(np.float64)
    for axis, coordinate in reversed(plain):
        scaled = min(max(coordinate, 0.0), 1.0) * (found.shape[axis] - 1)
        node = min(int(scaled), found.shape[axis] - 2)
        low, high = (np.take(found, node + k, axis) for k in (0, 1))
        found = low + (scaled - node) * (high - low)
    return Table(found)
