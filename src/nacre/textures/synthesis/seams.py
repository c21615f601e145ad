"""How far seams of a quilted texture stand out from its inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.fft

from nacre.array import Floats
from nacre.textures.synthesis.quilting import Sources

Edges = tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]
"""Of each texel, whether a seam lies between it and the one to its right, and the one below."""


def seams(sources: Sources, height: int, width: int, *, periodic: bool, tile: bool) -> Edges:
    """Where neighbors in the output, with such sources, are no neighbors in the input.

    Texels of opposite edges are neighbors in an input that is periodic, and in an output that
    tiles; where that does not, nothing lies beyond its last row and column.
    """
    y, x = np.divmod(sources, width)

    def apart(axis: int) -> npt.NDArray[np.bool_]:
        down, across = ((np.roll(c, -1, axis) - c) for c in (y, x))
        down, across = down - (axis == 0), across - (axis == 1)
        if periodic:
            down, across = down % height, across % width
        edges: npt.NDArray[np.bool_] = (down != 0) | (across != 0)
        if not tile:
            edges[(-1, slice(None)) if axis == 0 else (slice(None), -1)] = False
        return edges

    return apart(1), apart(0)


@dataclass(frozen=True)
class SeamContrast:
    """Differences across seams against those between all other neighbors.

    The ratio compares root mean squares: 1 where seams are no stronger than what is in the texture
    anyway, None where there is no seam or the inside is even.
    """

    ratio: float | None
    fraction: float  # share of all pairs of neighbors that have a seam between them


def seam_contrast(values: Floats, edges: Edges, *, tile: bool) -> SeamContrast:
    """Differences of anything that texels have, shape (height, width, n), across seams."""
    squares = np.zeros(2)
    counts = np.zeros(2)
    for axis, seam in zip((1, 0), edges, strict=True):
        steps = np.square(np.roll(values, -1, axis) - values).sum(-1, dtype=np.float64)
        if not tile:
            inner = (slice(-1), slice(None)) if axis == 0 else (slice(None), slice(-1))
            steps, seam = steps[inner], seam[inner]
        for index, chosen in enumerate((seam, ~seam)):
            squares[index] += steps[chosen].sum()
            counts[index] += np.count_nonzero(chosen)
    fraction = float(counts[0] / counts.sum()) if counts.any() else 0.0
    if not counts.all() or not squares[1]:
        return SeamContrast(None, fraction)
    means = squares / counts
    return SeamContrast(float(np.sqrt(means[0] / means[1])), fraction)


_CORRELATED = 0.2  # correlation below which texels count as unlike
_LENGTHS = 5
"""Of correlation in an edge of a patch, so that it holds a few of what the texture is made of."""
_SMALLEST = 8
_EVEN = 1.35
"""Contrast of the borders below which a texture tiles: those that do were found to have up to 1.26,
others 1.5 and more."""


def patch_size(features: Floats) -> int:
    """Edge of patches for a texture, from how far its texels are alike along rows and columns.

    It is at least 8 texels and at most half the texture's shorter edge, though at least 2. Features
    have shape (height, width, k), and means of zero.
    """
    limit = max(2, min(features.shape[:2]) // 2)
    length = max(_correlation_length(features, axis) for axis in (0, 1))
    return int(min(max(_LENGTHS * length, _SMALLEST), limit))


def overlap_of(patch: int) -> int:
    """Overlap of patches, three eighths of their edge: seams of wider ones are little better."""
    return max(1, 3 * patch // 8)


def tiles(features: Floats) -> bool:
    """Whether a texture goes on at its opposite edges, by differences there and inside."""
    none, last_column, last_row = np.zeros((3, *features.shape[:2]), np.bool_)
    last_column[:, -1] = last_row[-1] = True
    borders = (last_column, none), (none, last_row)
    contrasts = [seam_contrast(features, edges, tile=True).ratio for edges in borders]
    return all(ratio is None or ratio < _EVEN for ratio in contrasts)


def _correlation_length(features: Floats, axis: int) -> int:
    """Least distance along an axis at which texels are unlike; the whole edge where none is."""
    count = features.shape[axis]
    spectrum = scipy.fft.rfft(features.astype(np.float64), 2 * count, axis=axis)
    power = np.square(np.abs(spectrum)).sum((1 - axis, 2))
    correlation = scipy.fft.irfft(power)[:count] / np.arange(count, 0, -1)
    unlike = np.flatnonzero(correlation <= _CORRELATED * correlation[0])
    return int(unlike[0]) if len(unlike) else count
