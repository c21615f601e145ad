"""The 9/7 wavelet of JPEG 2000 (Cohen, Daubechies and Feauveau 1992) on maps of several channels.

Maps end as if mirrored at their first and last rows and columns. Coefficients of all levels are
about as large as the rounding of each is harmful: the transform is nearly orthonormal.
"""

from __future__ import annotations

import numpy as np

from nacre.array import Floats

_STEPS = (-1.586134342059924, -0.052980118572961, 0.882911075530934, 0.443506852043971)
"""Of lifting: what odd places, then even ones, and so on, get from both neighbors."""
_SCALE = np.float32(1.1496043988602418)

Bands = list[list[Floats]]
"""The coarsest mean alone, then of each level, coarse to fine, differences along y, x and both;
each of shape (channels, rows, columns), of which some may be empty."""


def decompose(maps: Floats, levels: int) -> Bands:
    """The bands of maps, shape (channels, height, width)."""
    found: Bands = []
    for _ in range(levels):
        left, right = _split(maps, 2)
        maps, below = _split(left, 1)
        found.append([below, *_split(right, 1)])
    return [[maps], *found[::-1]]


def compose(bands: Bands) -> Floats:
    """The maps that bands were made from."""
    (maps,), *levels = bands
    for along_y, along_x, both in levels:
        maps = _join(_join(maps, along_y, 1), _join(along_x, both, 1), 2)
    return maps


def band_shapes(height: int, width: int, levels: int) -> list[list[tuple[int, int]]]:
    """Rows and columns of the bands of a map, in the order of :func:`decompose`."""
    found = []
    for _ in range(levels):
        top, left = (height + 1) // 2, (width + 1) // 2
        found.append([(height - top, left), (top, width - left), (height - top, width - left)])
        height, width = top, left
    return [[(height, width)], *found[::-1]]


def _split(maps: Floats, axis: int) -> tuple[Floats, Floats]:
    lines = np.moveaxis(maps, axis, -1)
    even, odd = lines[..., 0::2].astype(np.float32), lines[..., 1::2].astype(np.float32)
    if odd.shape[-1]:
        for number, step in enumerate(_STEPS):
            _lift(even, odd, number, np.float32(step))
        even, odd = even * _SCALE, odd / _SCALE
    return np.moveaxis(even, -1, axis), np.moveaxis(odd, -1, axis)


def _join(low: Floats, high: Floats, axis: int) -> Floats:
    even, odd = (np.moveaxis(part, axis, -1) for part in (low, high))
    lines = np.empty((*even.shape[:-1], even.shape[-1] + odd.shape[-1]), np.float32)
    if odd.shape[-1]:
        even, odd = even / _SCALE, odd * _SCALE
        for number, step in reversed(list(enumerate(_STEPS))):
            _lift(even, odd, number, np.float32(-step))
    lines[..., 0::2], lines[..., 1::2] = even, odd
    return np.moveaxis(lines, -1, axis)


def _lift(even: Floats, odd: Floats, number: int, step: np.float32) -> None:
    """Add to places of one kind, in place, what both neighbors give."""
    evens, odds = even.shape[-1], odd.shape[-1]
    if number % 2 == 0:
        after = (
            even[..., 1:] if evens > odds else np.concatenate([even[..., 1:], even[..., -1:]], -1)
        )
        odd += step * (even[..., :odds] + after)
    else:
        before = np.concatenate([odd[..., :1], odd], -1)[..., :evens]
        after = odd if odds == evens else np.concatenate([odd, odd[..., -1:]], -1)
        even += step * (before + after)
