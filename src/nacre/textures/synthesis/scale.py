"""What a texture itself tells of how patches of it should be laid."""

from __future__ import annotations

import numpy as np
import scipy.fft

from nacre.array import Floats
from nacre.textures.synthesis.seams import seam_contrast

_CORRELATED = 0.2
"""Correlation below which texels count as unlike."""
_LENGTHS = 5
"""Of correlation in an edge of a patch, so that it holds a few of what the texture is made of."""
_LEAST = 8
_EVEN = 1.35
"""Contrast of the borders below which a texture tiles: those that do were found to have up to 1.26,
others 1.5 and more."""


def patch_size(features: Floats) -> int:
    """Edge of patches for a texture, from how far its texels are alike along rows and columns.

    It is at least 8 texels and at most half the texture's shorter edge, though at least 2.

    Parameters
    ----------
    features
        Of the texture, their means zero, shape (height, width, k).
    """
    most = max(2, min(features.shape[:2]) // 2)
    length = max(_correlation_length(features, axis) for axis in (0, 1))
    return int(min(max(_LENGTHS * length, _LEAST), most))


def overlap_of(patch: int) -> int:
    """Overlap of patches, three eighths of their edge: seams of wider ones are little better."""
    return max(1, 3 * patch // 8)


def tiles(features: Floats) -> bool:
    """Whether a texture goes on at its opposite edges, by differences there and inside."""
    shape = features.shape[:2]
    last_column, last_row = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    last_column[:, -1] = last_row[-1] = True
    none = np.zeros(shape, np.bool_)
    contrasts = [
        seam_contrast(features, edges, tile=True).ratio
        for edges in ((last_column, none), (none, last_row))
    ]
    return all(ratio is None or ratio < _EVEN for ratio in contrasts)


def _correlation_length(features: Floats, axis: int) -> int:
    """Least distance along an axis at which texels are unlike; the whole edge where none is."""
    count = features.shape[axis]
    spectrum = scipy.fft.rfft(features.astype(np.float64), 2 * count, axis=axis)
    power = np.square(np.abs(spectrum)).sum((1 - axis, 2))
    correlation = scipy.fft.irfft(power)[:count] / np.arange(count, 0, -1)
    unlike = np.flatnonzero(correlation <= _CORRELATED * correlation[0])
    return int(unlike[0]) if len(unlike) else count
