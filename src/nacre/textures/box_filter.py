"""Means over boxes: rows of texels made into fewer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from nacre.array import Floats


def halved(size: int) -> int:
    """Texels along an edge of the next level: half, rounded down, at least 1."""
    return max(1, size // 2)


def level_shapes(height: int, width: int) -> list[tuple[int, int]]:
    """Heights and widths of all levels, from the map itself to a single texel."""
    shapes = [(height, width)]
    while shapes[-1] != (1, 1):
        shapes.append((halved(shapes[-1][0]), halved(shapes[-1][1])))
    return shapes


def box_weights(size: int) -> Floats:
    """Weights of texels along an edge in those of the next level, shape (halved(size), size).

    Each texel of the next level covers as much of the edge as any other. Where the size is odd that
    is a little more than two texels, and those at the ends of it count by what is covered.
    """
    count = halved(size)
    ends = np.arange(count + 1) * (size / count)
    first = np.arange(size)
    covered = np.minimum(ends[1:, None], first + 1.0) - np.maximum(ends[:-1, None], first)
    return np.asarray(np.maximum(covered, 0.0) * (count / size), np.float32)


def halved_rows(rows: Iterable[Floats], height: int) -> Iterator[Floats]:
    """Rows of the next level, in order, of those of a map, which are used one by one.

    Parameters
    ----------
    rows
        Of any values, shape (width, ...).
    height
        How many there are.

    Yields
    ------
    array
        Shape (halved(width), ...).
    """
    down = box_weights(height)
    across: Floats | None = None
    sums: list[Floats | None] = [None] * (len(down) + 1)
    done = 0
    for y, row in enumerate(rows):
        if across is None:
            across = box_weights(len(row))
        narrow = np.tensordot(across, row, 1)
        for target in np.flatnonzero(down[:, y]):
            part, sum_ = down[target, y] * narrow, sums[target]
            sums[target] = part if sum_ is None else sum_ + part
        while done < len(down) and not down[done, y + 1 :].any():
            found = sums[done]
            assert found is not None
            sums[done] = None
            done += 1
            yield found
