"""Tiles of quantized wavelet bands as bytes, a chunk for each level, the coarsest first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre.compile.compilation import Compiled

Numbers = npt.NDArray[np.int32]
NumberBands = Sequence[Sequence[Numbers]]
"""Bands in the order of :func:`nacre.textures.rates.wavelet.decompose`, as whole numbers."""

LARGEST = (1 << 24) - 1
"""Magnitude of a number that can be written."""
UNARY, BITS = 14, 24
"""Magnitudes below the first are told one by one; of what is left above, how many bits it has."""
NEAR, FAR = 10, 6  # kinds of neighborhoods in the band, and outside of it
CONTEXTS = NEAR * FAR * (UNARY + BITS)
"""Probabilities of a kind of band."""
_KINDS = (0,), (1, 1, 2)  # of bands: means; differences along one axis, along both

_band = Compiled("nacre.textures.rates.range_loops:band")
_start = Compiled("nacre.textures.rates.range_loops:start")
_finish = Compiled("nacre.textures.rates.range_loops:finish")


def encode_bands(bands: NumberBands) -> list[bytes]:
    """A chunk of bytes for the means, and for each level: none where all numbers are zeros.

    Magnitudes are up to :data:`LARGEST`.
    """
    chunks = []
    coder = _Coder()
    for level in bands:
        data = np.empty(64 + sum(8 * band.size for band in level), np.uint8)
        some = any(band.any() for band in level)
        length = coder.run(level, data, writing=True) if some else 0
        chunks.append(data[: max(length, 1)].tobytes() if some else b"")
    return chunks


def decode_bands(
    chunks: Sequence[bytes], channels: int, shapes: Sequence[Sequence[tuple[int, int]]]
) -> list[list[Numbers]]:
    """The bands in chunks; levels that have none are zeros.

    Damaged chunks give other numbers. Shapes are those of
    :func:`nacre.textures.rates.wavelet.band_shapes`.
    """
    coder = _Coder()
    bands = [[np.zeros((channels, *shape), np.int32) for shape in level] for level in shapes]
    for level, chunk in zip(bands, chunks, strict=False):
        if chunk:
            coder.run(level, np.frombuffer(chunk, np.uint8).copy(), writing=False)
    return bands


def encode_table(table: Numbers) -> bytes:
    """A table of whole numbers, shape (rows, columns), as bytes."""
    (chunk,) = encode_bands([[np.ascontiguousarray(table[None])]])
    return chunk


def decode_table(chunk: bytes, shape: tuple[int, int]) -> Numbers:
    """The table of a shape that :func:`encode_table` wrote."""
    ((table,),) = decode_bands([chunk], 1, [[shape]])
    return table.reshape(shape)


class _Coder:
    """What the levels of a tile have shown so far: probabilities, and the level before."""

    def __init__(self) -> None:
        self._chances = np.zeros((3 * CONTEXTS, 3), np.int64)
        self._chances[:, :2] = 1 << 15
        self._before: Sequence[Numbers] = ()

    def run(self, level: Sequence[Numbers], data: npt.NDArray[np.uint8], writing: bool) -> int:
        """Write the bands of a level, or read them in place; gives the bytes written."""
        state = np.zeros(5, np.int64)
        kinds = _KINDS[min(len(level) - 1, 1)]
        empty = np.zeros((1, 0, 0), np.int32)
        coarser = self._before if len(self._before) == len(level) else [empty] * len(level)
        beside = empty
        _start(state, data, int(writing))
        for band, kind, before in zip(level, kinds, coarser, strict=True):
            if band.size:
                first = kind * CONTEXTS
                _band(band, beside, before, self._chances, first, state, data, int(writing))
                beside = band
        if writing:
            _finish(state, data)
        self._before = level
        return int(state[4])
