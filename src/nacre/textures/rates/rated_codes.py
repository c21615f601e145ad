"""Codes as a stream of bytes, the coarse picture first, by tiles that can be read alone.

A code is a center and a sum of axes. The numbers along the axes are maps over the texels; each tile
of them is transformed (:mod:`nacre.textures.rates.wavelet`), rounded to whole numbers, and written
(:mod:`nacre.textures.rates.bands`).
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.io.tensors import Tensors, check_numbers, format_errors
from nacre.runtime.parallel import thread_map
from nacre.textures.rates.bands import decode_bands, decode_table
from nacre.textures.rates.wavelet import band_shapes, compose

_LARGEST = 1e9
_MAX_NUMBERS, _MAX_TILE, _MAX_AXES, _MAX_LEVELS = 1 << 29, 1 << 10, 1 << 10, 12
_TENSORS = ("stream", "lengths", "axes", "steps", "scale", "center")


@dataclass(eq=False)
class _Recent:
    tiles: dict[int, npt.NDArray[np.float32]] = field(default_factory=dict)
    scattered: bool = False  # texels asked for once


@dataclass(frozen=True, eq=False)
class RatedCodes:
    """A map of codes in few bytes; a ValueError says that shapes, types or numbers do not fit."""

    not_content: ClassVar[frozenset[str]] = frozenset({"where"})

    height: int
    width: int
    stream: npt.NDArray[np.uint8]
    """Chunks: the means of all tiles, row by row, then the coarsest level of all, and so on."""
    lengths: npt.NDArray[np.uint32]  # of chunks, shape (1 + levels, tiles)
    axes: npt.NDArray[np.uint8]
    """What each number adds to a code: whole numbers, written as bands are, shape (r, code_dim)
    before that, to be multiplied by both that follow."""
    steps: npt.NDArray[np.float32]  # of the axes, shape (r,)
    scale: npt.NDArray[np.float32]  # of the values of codes, shape (code_dim,)
    center: npt.NDArray[np.float32]  # the code of all zeros, shape (code_dim,)
    tile: int  # texels along the edge of a tile
    where: str = "codes"  # what messages about their numbers begin with: a file's path

    def __post_init__(self) -> None:
        rank, size = len(self.steps), len(self.center)
        values, tile = self.height * self.width * size, self.tile
        if not 1 <= values <= _MAX_NUMBERS or not 1 <= tile <= _MAX_TILE:
            raise ValueError(f"{self.width} x {self.height} codes of {size} in tiles of {tile}")
        count = math.ceil(self.height / tile) * math.ceil(self.width / tile)
        for name, kind, shape in (
            ("stream", np.uint8, (self.stream.size,)),
            ("lengths", np.uint32, (len(self.lengths), count)),
            ("axes", np.uint8, (self.axes.size,)),
            ("steps", np.float32, (rank,)),
            ("scale", np.float32, (size,)),
            ("center", np.float32, (size,)),
        ):
            array = getattr(self, name)
            if array.dtype != kind or array.shape != shape:
                raise ValueError(f"{name} of codes are {array.dtype} {array.shape}")
        if rank > _MAX_AXES or len(self.lengths) > _MAX_LEVELS:
            raise ValueError(f"codes have {rank} axes in {len(self.lengths)} levels")
        if int(self.lengths.sum(dtype=np.int64)) != self.stream.size:
            raise ValueError("codes have another number of bytes than their tiles")
        for array in (self.steps, self.scale, self.center):
            if not float(np.abs(array).max(initial=0.0)) <= _LARGEST:
                raise ValueError(f"axes of codes are not numbers up to {_LARGEST:g}")

    @property
    def nbytes(self) -> int:
        """Bytes of everything that the codes are made from."""
        return sum(int(getattr(self, name).nbytes) for name in _TENSORS)

    @property
    def bytes_per_texel(self) -> float:
        return self.nbytes / (self.height * self.width)

    @property
    def tiles(self) -> list[tuple[slice, slice]]:
        """Rows and columns of texels of all tiles, in their order."""
        return tiles_of(self.height, self.width, self.tile)

    @cached_property
    def codes(self) -> npt.NDArray[np.float32]:
        """All codes, shape (height, width, code_dim)."""
        found = np.empty((self.height, self.width, len(self.center)), np.float32)
        parts = thread_map(self.tile_codes, range(len(self.tiles)))
        for place, codes in zip(self.tiles, parts, strict=True):
            found[place] = codes
        self._recent.tiles.clear()
        return found

    def codes_of(self, chosen: slice | npt.NDArray[np.integer[Any]]) -> npt.NDArray[np.float32]:
        """Codes of some texels, numbered row by row, shape (n, code_dim).

        Only the tiles that they lie in are decoded, of which a row is kept for the next call. All
        are, and stay, when texels are scattered over more than that for the second time.
        """
        across = math.ceil(self.width / self.tile)
        recent, count = self._recent, self.height * self.width
        wanted = (
            np.arange(*chosen.indices(count))
            if isinstance(chosen, slice)
            else np.arange(count)[chosen]
        )
        rows, columns = np.divmod(wanted, self.width)
        tiles = rows // self.tile * across + columns // self.tile
        known, touched = recent.tiles.copy(), np.unique(tiles).tolist()
        others = [index for index in touched if index not in known]
        if "codes" in vars(self) or (recent.scattered and len(others) > across):
            return self.codes.reshape(-1, len(self.center))[wanted]
        recent.scattered = recent.scattered or len(others) > across
        decoded = thread_map(self.tile_codes, others)
        found = np.empty((len(wanted), len(self.center)), np.float32)
        for index in touched:
            codes = known.pop(index) if index in known else next(decoded)
            here = np.flatnonzero(tiles == index)
            found[here] = codes[rows[here] % self.tile, columns[here] % self.tile]
            if index in touched[-across:]:
                recent.tiles[index] = codes
        for index in known:
            recent.tiles.pop(index, None)
        return found

    @cached_property
    def _recent(self) -> _Recent:
        return _Recent()

    def tile_codes(self, index: int) -> npt.NDArray[np.float32]:
        """The codes of one tile, shape (rows, columns, code_dim); reads nothing of the others.

        Raises a FormatError if they are not finite or too large.
        """
        rows, columns = self.tiles[index]
        height, width = rows.stop - rows.start, columns.stop - columns.start
        starts = self._starts[:, index].tolist()
        chunks = [
            self.stream[start : start + length].tobytes()
            for start, length in zip(starts, self.lengths[:, index].tolist(), strict=True)
        ]
        shapes = band_shapes(height, width, len(self.lengths) - 1)
        bands = decode_bands(chunks, len(self.steps), shapes)
        maps = compose([[band.astype(np.float32) for band in level] for level in bands])
        along = maps.reshape(len(self.steps), height * width).T
        codes = along @ self._matrix + self.center
        with format_errors(self.where):
            check_numbers({"codes": codes}, _LARGEST)
        return np.asarray(codes.reshape(height, width, -1), np.float32)

    @cached_property
    def _matrix(self) -> npt.NDArray[np.float32]:
        table = decode_table(self.axes.tobytes(), (len(self.steps), len(self.center)))
        return np.asarray(table * self.steps[:, None] * self.scale, np.float32)

    @cached_property
    def _starts(self) -> npt.NDArray[np.int64]:
        ends = np.cumsum(self.lengths.reshape(-1), dtype=np.int64)
        return (ends - self.lengths.reshape(-1)).reshape(self.lengths.shape)

    def without(self, levels: int) -> RatedCodes:
        """The codes without the finest levels: the start of the stream."""
        kept = len(self.lengths) - levels
        lengths = np.where(np.arange(len(self.lengths))[:, None] < kept, self.lengths, 0)
        stream = self.stream[: int(lengths.sum(dtype=np.int64))]
        return replace(self, stream=stream, lengths=lengths.astype(np.uint32))

    def pack(self) -> tuple[dict[str, Any], Tensors]:
        """What a file holds: numbers, and tensors, of which the stream comes last."""
        numbers = {"height": self.height, "width": self.width, "tile": self.tile}
        tensors: Tensors = {f"codes.{name}": getattr(self, name) for name in _TENSORS}
        return numbers | {"crc32": self._sums()}, tensors

    def _sums(self) -> list[int]:
        """The CRC-32 of the bytes of each level; axes and center belong to the first."""
        ends = np.cumsum(self.lengths.sum(axis=1, dtype=np.int64))[:-1]
        first, *others = (part.tobytes() for part in np.split(self.stream, ends))
        decoder = b"".join(getattr(self, name).tobytes() for name in _TENSORS[2:])
        return [zlib.crc32(part) for part in (decoder + first, *others)]

    @classmethod
    def unpack(
        cls,
        numbers: dict[str, Any],
        tensors: Tensors,
        levels: int | None = None,
        where: str = "codes",
    ) -> RatedCodes:
        """The codes that :meth:`pack` packed, or their first `levels`, means included.

        Raises a KeyError, TypeError or ValueError if a field is missing or bad, or bytes are not
        those that were written.
        """
        for name in ("height", "width", "tile"):
            if type(numbers[name]) is not int or numbers[name] < 0:
                raise ValueError(f"codes: {name} is {numbers[name]!r:.40}, not a whole number")
        arrays: Any = {name: tensors[f"codes.{name}"] for name in _TENSORS}
        sizes = {name: numbers[name] for name in ("height", "width", "tile")}
        found = cls(**sizes, **arrays, where=where)
        count = len(found.lengths) if levels is None else min(levels, len(found.lengths))
        sums = numbers["crc32"]
        if not isinstance(sums, list) or found._sums()[:count] != sums[:count]:
            raise ValueError("codes are cut short or damaged; copy or encode the file again")
        return found if count == len(found.lengths) else found.without(len(found.lengths) - count)


def tiles_of(height: int, width: int, tile: int) -> list[tuple[slice, slice]]:
    """Rows and columns of the tiles of a map, row by row."""

    def parts(size: int) -> list[slice]:
        return [slice(start, min(start + tile, size)) for start in range(0, size, tile)]

    return [(rows, columns) for rows in parts(height) for columns in parts(width)]


def stream_of(
    tiles: Sequence[Sequence[npt.NDArray[np.uint8]]],
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint32]]:
    """The stream and the lengths of the chunks of all tiles."""

    def by_level() -> Iterator[Sequence[npt.NDArray[np.uint8]]]:
        yield from zip(*tiles, strict=True)

    lengths = np.array([[len(chunk) for chunk in level] for level in by_level()], np.uint32)
    return np.concatenate([chunk for level in by_level() for chunk in level]), lengths
