"""Codes of a texture as it looks from further and further away."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import FormatError
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import Filter, TexelMap, on_all_cores
from nacre.textures.latent_map import LatentMap


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
    """Weights with which texels along an edge enter those of the next level, (halved(size), size).

    Each texel of the next level covers as much of the edge as any other. Where the size is odd that
    is a little more than two texels, and those at its ends count by how much of them is covered.
    """
    count = halved(size)
    ends = np.arange(count + 1) * (size / count)
    first = np.arange(size)
    covered = np.minimum(ends[1:, None], first + 1.0) - np.maximum(ends[:-1, None], first)
    return np.asarray(np.maximum(covered, 0.0) * (count / size), np.float32)


def halved_rows(rows: Iterable[Floats], height: int) -> Iterator[Floats]:
    """Rows of the next level, shape (halved(width), ...), in order.

    They are made from `height` rows of any values, shape (width, ...), which are used one by one.
    """
    down = box_weights(height)
    across: Floats | None = None
    sums: dict[Any, Floats] = {}
    done = 0
    for y, row in enumerate(rows):
        if across is None:
            across = box_weights(len(row))
        narrow = np.tensordot(across, row, 1)
        for target in np.flatnonzero(down[:, y]):
            part = down[target, y] * narrow
            sums[target] = sums[target] + part if target in sums else part
        while done < len(down) and not down[done, y + 1 :].any():
            yield sums.pop(done)
            done += 1


FILTERS: tuple[Filter, ...] = get_args(Filter)

PAIRS = 512  # pairs of directions that reflectance is averaged at, unless others are asked for


@dataclass(frozen=True, eq=False)
class LatentPyramid:
    """A map of codes at every size from its own to a single texel, and lookups between them.

    Maps repeat in both directions. Levels have shapes (height, width, values), as
    :func:`level_shapes` says; a ValueError says that they do not.
    """

    levels: tuple[Floats, ...]

    def __post_init__(self) -> None:
        shapes = [codes.shape for codes in self.levels]
        if not shapes or any(len(shape) != 3 or not all(shape) for shape in shapes):
            raise ValueError(f"levels are {shapes}, expected (height, width, values)")
        height, width, values = shapes[0]
        if shapes != [(*shape, values) for shape in level_shapes(height, width)]:
            raise ValueError(f"levels are {shapes}, expected halves down to a single texel")

    @classmethod
    def build(
        cls,
        latent: LatentMap,
        by: Filter | None = None,
        pairs: int = PAIRS,
        seed: int = 0,
        progress: Progress = silent,
    ) -> LatentPyramid:
        """The pyramid of a map.

        What is averaged over boxes: "reflectance" encodes every level from means of what the map
        decodes to, which is what is seen from afar, but for the codec's own error, at so many of
        the map's pairs of directions, drawn at random; "codes" is faster (Rainer et al. 2020,
        section 5.2 and figure 9), with errors where texels with unlike highlights meet. By default
        it is the codec's :attr:`~nacre.textures.codecs.codec.TexelCodec.filtered_by`. Progress is
        called with the rows done. A FormatError says that a code decodes, or a mean is encoded, to
        values that are not finite.
        """
        by = latent.codec.filtered_by if by is None else by
        if by not in FILTERS:
            raise ValueError(f"by is one of {', '.join(FILTERS)}, not {by!r}")
        height, width = latent.shape[:2]
        shapes = level_shapes(height, width)
        levels = [np.empty((*shape, latent.codec.code_dim), np.float32) for shape in shapes]
        levels[0][:] = latent.codes
        if by == "codes":
            rows: Iterable[Floats] = levels[0]
            record: TexelMap = np.asarray
        else:
            count = len(latent.wi)
            chosen = np.random.default_rng(seed).choice(count, min(pairs, count), replace=False)
            chosen.sort()
            wi, wo = latent.wi[chosen], latent.wo[chosen]
            decode = on_all_cores(latent.codec, latent.codec.decoder(wi, wo))
            record = on_all_cores(latent.codec, latent.codec.encoder(wi, wo))
            rows = (decode(row) for row in levels[0])
        rows = _reported(rows, height, progress)
        fill_levels(rows, levels, record)
        if not all(np.isfinite(codes).all() for codes in levels):
            raise FormatError(f"{latent.name}: some filtered codes are not finite")
        return cls(tuple(levels))

    def __call__(self, uv: npt.NDArray[Any], level: npt.NDArray[Any]) -> Floats:
        """Codes by trilinear interpolation, shape (n, values).

        At places `uv`, shape (n, 2), u grows to the right and v down, from 0 to 1 over the map,
        which repeats beyond. `level`, shape (n,), is the base 2 logarithm of a footprint's width in
        texels of the map; it is clipped to the levels that exist.
        """
        last = len(self.levels) - 1
        level = np.clip(np.asarray(level, np.float64), 0.0, last)
        lower = np.minimum(level.astype(np.intp), max(last - 1, 0))
        fraction = (level - lower)[:, None]
        codes = np.empty((len(uv), self.levels[0].shape[2]), np.float32)
        for index in np.unique(lower):
            rows = lower == index
            fine = _bilinear(self.levels[index], uv[rows])
            coarse = _bilinear(self.levels[min(index + 1, last)], uv[rows])
            codes[rows] = fine + fraction[rows] * (coarse - fine)
        return codes


def fill_levels(rows: Iterable[Floats], levels: Sequence[Floats], record: TexelMap) -> None:
    """Write what is kept of the texels of all levels but the first, from means over boxes.

    `rows`, shape (width, ...), are what is averaged in the first level, in order; levels have
    shapes (height, width, numbers); `record` turns means of a row into what is kept of it.
    """
    for above, kept in itertools.pairwise(levels):
        rows = recorded(halved_rows(rows, len(above)), kept, record)
    with one_blas_thread():
        for _ in rows:  # each row is used by all levels as soon as it is known
            pass


def recorded(rows: Iterable[Floats], kept: Floats, record: TexelMap) -> Iterator[Floats]:
    """The same rows; what is kept of each is written before it is passed on."""
    for y, row in enumerate(rows):
        kept[y] = record(row)
        yield row


def filtered_reflectance(latent: LatentMap, wi: Floats, wo: Floats) -> list[Floats]:
    """Means of what a map decodes to over the boxes of all levels: what is seen from afar.

    Directions are unit vectors, shape (n, 3). For each level after the map itself, reflectance
    factors have shape (height, width, n, 3).
    """
    decode = on_all_cores(latent.codec, latent.codec.decoder(wi, wo))
    rows: Iterable[Floats] = (decode(row.astype(np.float32)) for row in latent.codes)
    levels: list[Floats] = []
    for height, _ in level_shapes(*latent.shape[:2])[:-1]:
        rows = np.stack(list(halved_rows(rows, height)))
        levels.append(rows)
    return levels


def _reported(rows: Iterable[Floats], count: int, progress: Progress) -> Iterator[Floats]:
    for done, row in enumerate(rows, 1):
        yield row
        progress("filtering", done, count, "")


def _bilinear(codes: Floats, uv: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Codes between the four texels around each place, of a map that repeats."""
    height, width = codes.shape[:2]
    sizes = enumerate((width, height))
    x, y = (np.mod(uv[:, axis].astype(np.float64), 1.0) * n - 0.5 for axis, n in sizes)
    left, top = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    across, down = (x - left)[:, None], (y - top)[:, None]

    def row(y: npt.NDArray[np.intp]) -> npt.NDArray[np.float64]:
        first, second = codes[y % height, left % width], codes[y % height, (left + 1) % width]
        return np.asarray(first + across * (second - first), np.float64)

    above, below = row(top), row(top + 1)
    return np.asarray(above + down * (below - above))
