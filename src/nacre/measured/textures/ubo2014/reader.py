"""A texture that stays in its factors: values are matrix products of those asked for."""

from __future__ import annotations

import itertools
import mmap
import os
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf, Indices
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike, opened
from nacre.measured.textures.ubo2014.header import CHANNELS, Factors, Header, largest, parse
from nacre.runtime.parallel import thread_map

_LARGEST_VALUE = 1e9
_TILE = 128, 512  # texels and pairs at a time: three channels of them fit a core's own cache
_CHECKED = 1 << 20  # numbers that are checked at a time

_Matrix = npt.NDArray[Any]


class Ubo2014Btf(Btf):
    """A texture in a `.btf` file, decoded as it is asked for; see :func:`load`.

    Values are those in the file after its color model was undone, divided by the cosine of the
    light's polar angle where the file says that they were multiplied by it. They are clamped to be
    non-negative: values below 0 come from leaving out components.
    """

    def __init__(self, header: Header, channels: list[tuple[_Matrix, _Matrix]], name: str) -> None:
        wi = _vectors(header.lights.reshape(-1, 2))
        wo = np.repeat(_vectors(header.views), header.lights.shape[1], axis=0)
        super().__init__(header.width, header.height, wi, wo, name=name)
        self.header, self._channels = header, channels
        self._scale = 1.0 / self.wi[:, 2] if header.cosine else None

    def factors(self, channel: int) -> tuple[_Matrix, _Matrix]:
        """Matrices of a channel as they lie in the file, pairs (n, k) and texels (texels, k): their
        inner products are the channel before its color model is undone.
        """
        return self._channels[channel]

    def describe(self) -> dict[str, Any]:
        return super().describe() | {
            "color model": self.header.colors.model.name,
            "components of a channel": self._channels[0][0].shape[1],
        }

    def texels(self, chosen: Indices | slice) -> Floats:
        rows = [np.asarray(texels[chosen], np.float32) for _, texels in self._channels]
        return self._product(rows, self._pairs, None, self._scale)

    @cached_property
    def _pairs(self) -> list[npt.NDArray[np.float32]]:
        """What all texels share, kept: much less than one block of texels takes."""
        return [pairs.astype(np.float32) for pairs, _ in self._channels]

    def images(self, chosen: Indices | slice) -> Floats:
        rows = [np.asarray(pairs[chosen], np.float32) for pairs, _ in self._channels]
        columns = [np.asarray(texels, np.float32) for _, texels in self._channels]
        scale = None if self._scale is None else self._scale[chosen]
        values = self._product(rows, columns, scale, None)
        return values.reshape(-1, self.height, self.width, 3)

    def _product(
        self,
        rows: list[_Matrix],
        columns: list[_Matrix],
        row_scale: Floats | None,
        column_scale: Floats | None,
    ) -> Floats:
        """Colors of each row with each column, shape (rows, columns, 3), tile after tile."""
        values = np.empty((len(rows[0]), len(columns[0]), 3), np.float32)
        tiles = itertools.product(
            range(0, values.shape[0], _TILE[0]), range(0, values.shape[1], _TILE[1])
        )

        def fill(start: tuple[int, int]) -> None:
            here = tuple(slice(a, a + size) for a, size in zip(start, _TILE, strict=True))
            tile = values[here]
            channels = np.empty((CHANNELS, *tile.shape[:2]), np.float32)
            for row, column, channel in zip(rows, columns, channels, strict=True):
                np.matmul(row[here[0]], column[here[1]].T, out=channel)
            rgb = self.header.colors.to_rgb(channels)
            if row_scale is not None:
                rgb *= row_scale[here[0], None]
            if column_scale is not None:
                rgb *= column_scale[here[1]]
            for c in range(3):
                np.clip(rgb[c], 0.0, _LARGEST_VALUE, out=tile[..., c])

        list(thread_map(fill, tiles))
        return values


def load(path: PathLike) -> Ubo2014Btf:
    """Open a `.btf` file of the database UBO2014; its matrices stay in the file.

    All of the header is checked, and that no number in the matrices is not finite or too large,
    which reads the file once. No original file was at hand when this was written. A
    :class:`FormatError` says that the file has another format or a newer version, holds spectra or
    a color model that is not known, or is damaged.
    """
    data = _mapped(Path(path))
    header, factors = parse(data, path)
    channels = []
    for name, places in zip(header.channels, factors, strict=True):
        where = f"{path}: channel '{name}': matrix"
        u = _matrix(data, places, places.u_start, places.rows, f"{where} U")
        sxv = _matrix(data, places, places.sxv_start, places.columns, f"{where} SxV")
        # Where there are as many texels as pairs, rows are pairs, as in the files of Bonn.
        channels.append((u, sxv) if places.rows == header.pair_count else (sxv, u))
    return Ubo2014Btf(header, channels, Path(path).stem)


def _vectors(angles: npt.NDArray[np.float32]) -> Floats:
    theta, phi = np.moveaxis(angles.astype(np.float64), -1, 0)
    return join(from_spherical(theta, phi)).astype(np.float32)


def _mapped(path: Path) -> mmap.mmap:
    with opened(path) as file:
        if os.fstat(file.fileno()).st_size == 0:
            raise FormatError(f"{path}: is empty")
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)


def _matrix(data: mmap.mmap, places: Factors, start: int, rows: int, where: str) -> _Matrix:
    """A matrix of the file, without numbers that are too large or not finite.

    Of floats without their sign, the larger has the larger bit pattern, and what is not finite the
    largest: integers are much faster to compare than halves.
    """
    scalar = places.scalar
    whole = np.dtype(f"<u{scalar.itemsize}")
    sign = whole.type(1 << (8 * scalar.itemsize - 1))
    bound = np.array(largest(scalar), scalar).view(whole)
    flat = np.frombuffer(data, whole, rows * places.components, start)
    for first in range(0, len(flat), _CHECKED):
        if ((flat[first : first + _CHECKED] & ~sign) > bound).any():
            raise FormatError(f"{where}: holds numbers that are not finite or too large")
    return flat.view(scalar).reshape(rows, places.components)
