"""How far seams of a quilted texture stand out from its inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.textures.synthesis.quilting import Sources

Edges = tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]
"""Of each texel, whether a seam lies between it and the one to its right, and the one below."""


def seams(sources: Sources, height: int, width: int, *, periodic: bool, tile: bool) -> Edges:
    """Where neighbors of the output are no neighbors in the input.

    Parameters
    ----------
    sources
        Of the output's texels.
    height, width
        Of the input.
    periodic
        Whether the input tiles, so that texels of opposite edges are neighbors.
    tile
        Whether the output does; where it does not, nothing lies beyond its last row and column.
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

    Parameters
    ----------
    ratio
        Of root mean squares; 1 where seams are no stronger than what is in the texture anyway, None
        where there is no seam or the inside is even.
    share
        Of all pairs of neighbors, how many have a seam between them.
    """

    ratio: float | None
    share: float


def seam_contrast(values: Floats, edges: Edges, *, tile: bool) -> SeamContrast:
    """Differences of anything that texels have, shape (height, width, n), across seams."""
    squares = np.zeros(2)
    counts = np.zeros(2)
    for axis, seam in zip((1, 0), edges, strict=True):
        steps = np.square(np.roll(values, -1, axis) - values).sum(-1, dtype=np.float64)
        inner: Any = slice(None) if tile else (slice(None), slice(-1))
        if not tile:
            inner = (slice(-1), slice(None)) if axis == 0 else (slice(None), slice(-1))
        steps, seam = steps[inner], seam[inner]
        for index, chosen in enumerate((seam, ~seam)):
            squares[index] += steps[chosen].sum()
            counts[index] += np.count_nonzero(chosen)
    share = float(counts[0] / counts.sum()) if counts.any() else 0.0
    if not counts.all() or not squares[1]:
        return SeamContrast(None, share)
    means = squares / counts
    return SeamContrast(float(np.sqrt(means[0] / means[1])), share)
