"""Maps of codes to streams of bytes: tile by tile, of which few are in memory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats
from nacre.runtime.journal import Journal
from nacre.runtime.parallel import one_blas_thread, thread_map
from nacre.textures.rates.bands import LARGEST, NumberBands, Numbers, encode_bands, encode_table
from nacre.textures.rates.rated_codes import RatedCodes, stream_of, tiles_of
from nacre.textures.rates.wavelet import Bands, compose, decompose

LEVELS = 4
"""Levels of the wavelet in a tile."""
_FEW = 8  # tiles that stand for all of a map that has more than twice as many
_TOWARD_ZERO = 0.35  # of a step: what is added before magnitudes are cut to whole numbers
_BIT = 0.1155
"""The squared error, in steps squared, that a bit removes from fine rounding: log(2) / 6."""
_RIDGE = 1e-9
_AXIS = 0.1  # of the size of an axis: the step of its numbers, if it is one step of rounding long
_AXIS_BITS = 4.0  # of a number of an axis, about
_ROWS = 1 << 11  # texels that are added to sums of products at a time

Axes = tuple[Doubles, Doubles, Doubles]
"""The code of all zeros (n,), what turns codes into numbers along axes (n, n), and how much each
value of a code is felt (n,); see :class:`nacre.textures.code_space.CodeSpace`."""
Chosen = npt.NDArray[np.intp]
Report = Callable[[int, int], None]
"""Called with the tiles done, and with how many there are."""


class Tiled:
    """A map of codes, shape (height, width, n), as tiles that are transformed when they are needed.

    All results are the same for any number of threads. The tiles of a small map, or some that stand
    for a large one, stay in memory.
    """

    def __init__(
        self, codes: npt.NDArray[Any], axes: Axes, tile: int, journal: Journal, report: Report
    ) -> None:
        self._codes, self._tile, self._journal, self._report = codes, tile, journal, report
        self._center, self._onto, self._felt = (part.astype(np.float32) for part in axes)
        self._places = tiles_of(codes.shape[0], codes.shape[1], tile)
        count = len(self._places)
        self.is_large = count > 2 * _FEW
        chosen = np.linspace(0, count - 1, _FEW).astype(int) if self.is_large else range(count)
        self._few: list[int] = [int(k) for k in chosen]
        self._bands = lru_cache(len(self._few))(self._transformed)
        largest, (total,) = self._all(self._sized)
        self._largest, self._mean = float(max(largest)), total / self.texels

    @property
    def texels(self) -> int:
        return int(self._codes.shape[0] * self._codes.shape[1])

    @property
    def finest(self) -> float:
        """The least step whose numbers can be written."""
        return max(self._largest / LARGEST, 1e-30)

    @property
    def coarsest(self) -> float:
        """A step at which all numbers are zeros."""
        return max(2.0 * self._largest, 1e-30)

    @property
    def guess(self) -> float:
        """A step to begin with."""
        return max(0.03 * self._largest, self.finest)

    def few_bytes(self, step: float) -> float:
        """Bytes of chunks per texel at a step, from some tiles."""

        def size(k: int) -> int:
            return sum(map(len, encode_bands(_rounded(self._bands(k), step))))

        return sum(thread_map(size, self._few)) / self._few_texels

    def few_loss(self, step: float) -> float:
        """The mean square, over texels, of what rounding takes away, from some tiles."""

        def lost(k: int) -> float:
            found = 0.0
            for band, number in _pairs(self._bands(k), step):
                found += float(np.square(band - np.float32(step) * number).sum(dtype=np.float64))
            return found

        return sum(thread_map(lost, self._few)) / self._few_texels

    def rated(self, step: float) -> RatedCodes:
        """The map at a step of rounding, decoded by axes that are fitted to the rounded numbers."""
        _, (saved,) = self._all(lambda k: (None, _saved(self._bands(k), step)))
        worth = _BIT * _AXIS_BITS * self._codes.shape[2] * step * step
        kept = np.flatnonzero(saved > worth)
        chunks, sums = self._all(lambda k: self._written(k, step, kept))
        return self._decodable(*stream_of(chunks), *sums)

    def plainest(self) -> RatedCodes:
        """One code for all texels: their mean."""
        lengths = np.zeros((1 + LEVELS, len(self._places)), np.uint32)
        size = self._codes.shape[2]
        total = (self._mean - self._center) * self.texels
        nothing = np.zeros((0, 0)), np.zeros((0, size)), np.zeros(0)
        return self._decodable(np.zeros(0, np.uint8), lengths, *nothing, total)

    @property
    def _few_texels(self) -> int:
        sides = [(part.stop - part.start for part in self._places[k]) for k in self._few]
        return sum(map(math.prod, sides))

    def _transformed(self, k: int) -> Bands:
        along = (self._codes[self._places[k]].astype(np.float32) - self._center) @ self._onto
        return decompose(np.moveaxis(along, -1, 0), LEVELS)

    def _sized(self, k: int) -> tuple[float, Doubles]:
        """The largest number of a tile, and the sum of its codes."""
        largest = max(float(np.abs(band).max(initial=0.0)) for band in chain(*self._bands(k)))
        return largest, self._codes[self._places[k]].sum((0, 1), dtype=np.float64)

    def _written(self, k: int, step: float, kept: Chosen) -> tuple[Any, ...]:
        """Chunks of a tile, and sums that :func:`_fitted` needs."""
        numbers = [[band[kept] for band in level] for level in _rounded(self._bands(k), step)]
        chunks = [np.frombuffer(chunk, np.uint8) for chunk in encode_bands(numbers)]
        maps = compose([[band.astype(np.float32) for band in level] for level in numbers])
        along = maps.reshape(len(kept), maps.shape[1] * maps.shape[2]).T
        codes = self._codes[self._places[k]].reshape(len(along), -1)
        size = codes.shape[1]
        sums = np.zeros((len(kept) + 1, len(kept) + size))
        for start in range(0, len(along), _ROWS):
            part = along[start : start + _ROWS].astype(np.float64)
            off = codes[start : start + _ROWS] - self._center.astype(np.float64)
            left = np.concatenate([part, np.ones((len(part), 1))], axis=1)
            sums += left.T @ np.concatenate([part, off], axis=1)
        products, totals = sums[:-1], sums[-1]
        rank = len(kept)
        return chunks, products[:, :rank], products[:, rank:], totals[:rank], totals[rank:]

    def _all(self, work: Callable[[int], tuple[Any, ...]]) -> tuple[list[Any], list[Doubles]]:
        """What `work` makes of each tile: the first part of each, and the sums of the others."""
        firsts: list[Any] = []
        sums: list[Doubles] = []
        parts: Iterator[tuple[Any, ...]] | None = None

        def take(k: int) -> None:
            nonlocal parts
            parts = parts or thread_map(work, range(k, len(self._places)))
            first, *others = next(parts)
            firsts.append(first)
            sums[:] = [a + b for a, b in zip(sums, others, strict=True)] if sums else others

        def restore(kept: Any) -> None:
            firsts.extend(kept["each"])
            sums.extend(kept["sums"])

        def state() -> Any:
            return {"each": list(firsts), "sums": list(sums)}

        for done in self._journal.steps(len(self._places), take, state, restore):
            self._report(done, len(self._places))
        return firsts, sums

    def _decodable(
        self, stream: npt.NDArray[np.uint8], lengths: npt.NDArray[np.uint32], *sums: Doubles
    ) -> RatedCodes:
        with one_blas_thread():
            axes, steps, scale, off = _fitted(self.texels, self._felt, *sums)
        center = (self._center + off).astype(np.float32)
        height, width, _ = self._codes.shape
        return RatedCodes(
            height, width, stream, lengths, axes, steps, scale, center, tile=self._tile
        )


def _rounded(bands: Bands, step: float) -> NumberBands:
    """Whole numbers of steps; those that are hardly more than one less are one less."""

    def rounded(band: Floats) -> npt.NDArray[np.int32]:
        sizes = np.floor(np.abs(band) * np.float32(1.0 / step) + np.float32(_TOWARD_ZERO))
        signed: npt.NDArray[np.int32] = np.copysign(np.minimum(sizes, LARGEST), band).astype(
            np.int32
        )
        return signed

    return [[rounded(band) for band in level] for level in bands]


def _pairs(bands: Bands, step: float) -> Iterator[tuple[Floats, Numbers]]:
    """Bands, and their whole numbers."""
    return zip(chain(*bands), chain(*_rounded(bands, step)), strict=True)


def _saved(bands: Bands, step: float) -> Doubles:
    """By how much each axis lowers the squared error of a tile."""
    saved = np.zeros(len(bands[0][0]))
    for band, number in _pairs(bands, step):
        left = np.square(band - np.float32(step) * number)
        saved += (np.square(band) - left).sum((1, 2), dtype=np.float64)
    return saved


def _fitted(
    count: int, felt: Floats, products: Doubles, crossed: Doubles, along: Doubles, codes: Doubles
) -> tuple[npt.NDArray[np.uint8], Floats, Floats, Doubles]:
    """Axes, their steps, the scale of values and the center that bring sums closest to codes.

    An axis is rounded the more finely, the longer it is; `felt` is how much each value matters. Of
    `count` texels, sums of products of numbers along axes (r, r), of these with codes (r, n), of
    numbers and of codes are known.
    """
    mean, center = along / count, codes / count
    normal = products - count * np.outer(mean, mean)
    lengths = np.sqrt(np.maximum(np.diag(normal) / count, 1e-12))
    normal += np.eye(len(normal)) * max(_RIDGE * float(np.trace(normal)), 1e-30)
    axes = np.linalg.solve(normal, crossed - count * np.outer(mean, center))
    sizes = np.sqrt(np.square(axes * felt).mean(axis=1))
    steps = (_AXIS * np.maximum(sizes, 1e-30) / lengths).astype(np.float32)
    scale = np.asarray(1.0 / felt, np.float32)
    table = np.round(axes / (steps[:, None] * scale)).clip(-LARGEST, LARGEST).astype(np.int32)
    center = center - mean @ (table * steps[:, None] * scale).astype(np.float64)
    written = np.frombuffer(encode_table(table), np.uint8)
    return written, steps, scale, center
