"""Any texture as a `.btf` file: its channels factored block after block of texels."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.geometry import split, to_spherical
from nacre.io.files import PathLike, atomic_path
from nacre.measured.textures.directions import PAIR_LIMIT
from nacre.measured.textures.transposition import transposed
from nacre.measured.textures.ubo2014.color_models import ColorModel, Decorrelation
from nacre.measured.textures.ubo2014.header import (
    CHANNELS,
    COMPONENT_LIMIT,
    SCALARS,
    TEXEL_LIMIT,
    Angles,
    Factors,
    Header,
    largest,
    pack,
    pack_factors,
)
from nacre.measured.textures.ubo2014.reader import Ubo2014Btf, load
from nacre.numerics.pca import PASSES, leading_directions
from nacre.runtime.progress import Progress

COMPONENTS = 64  # components of a channel unless others are asked for

_BLOCK = 1 << 26  # bytes of values that are read at a time
_HORIZON = 1e-5


@dataclass(frozen=True)
class Loss:
    """What a file that keeps some components of a texture has lost.

    The error is the mean absolute difference between the values read back and those of the texture,
    negative ones as they were, relative to the mean absolute value of these; 0 for a black texture.
    Squares would tell about the highlights only.
    """

    error: float
    negative: float  # share of the values that were below 0, which were written as 0


def save(
    btf: Btf,
    path: PathLike,
    components: int = COMPONENTS,
    model: ColorModel = ColorModel.YLOG_UDIVY_VDIVY,
    scalar_size: int = 2,
    progress: Progress | None = None,
) -> Loss:
    """Write a texture as a `.btf` file, whole or not at all; gives what that loses.

    The texture is gone through four times, and once more for :attr:`ColorModel.PCA`: to find the
    leading directions of each channel, to project it, and to compare it with what was written.
    Memory is taken for some blocks of texels and for the matrices over pairs of directions. Notes
    on the measurement are kept where the texture comes from such a file itself. Negative values are
    written as 0. Progress is called with texels done, over all passes.

    A channel, of those that the color model makes, has so many components, at most as many as there
    are texels, and pairs. Numbers take 2 bytes, as in the files of Bonn, 4 or 8.

    Raises
    ------
    FormatError
        If values are not finite or do not fit the numbers, directions are not above the horizon,
        there are too many of something, or the path cannot be written.
    """
    if scalar_size not in SCALARS or components < 1:
        raise ValueError("a number takes 2, 4 or 8 bytes, and there is at least one component")
    pairs = "pairs of directions", btf.pair_count, PAIR_LIMIT
    for what, count, limit in (pairs, ("texels", btf.texel_count, TEXEL_LIMIT)):
        if not 1 <= count <= limit:
            raise FormatError(f"{path}: {count} {what}, the format is read with 1 to {limit}")
    scalar = SCALARS[scalar_size]
    k = min(components, btf.pair_count, btf.texel_count, COMPONENT_LIMIT)
    views, lights = _grid(btf, str(path))
    folder, dtype = Path(path).parent, None if scalar_size == 2 else np.float32
    with (
        atomic_path(path) as temporary,
        transposed(btf, folder, dtype, progress=progress) as texels,
    ):
        source = _Source(texels, str(path), PASSES + 2 + (model is ColorModel.PCA), progress)
        colors = source.principal_colors() if model is ColorModel.PCA else Decorrelation(model)
        header = replace(_notes(btf), views=views, lights=lights, colors=colors)
        directions = leading_directions(
            lambda: (list(c) for _, c in source.channels(colors)), CHANNELS, btf.pair_count, k, 0
        )
        with temporary.open("wb") as file:
            file.write(pack(header, k))
            _write_factors(file, source, colors, [u.astype(scalar) for u in directions])
        return source.loss(load(temporary))


class _Source:
    """The texture to be written, gone through block after block, several times."""

    def __init__(self, btf: Btf, path: str, passes: int, progress: Progress | None) -> None:
        self.btf, self.path = btf, path
        self._total, self._done = passes * btf.texel_count, 0
        self._progress = progress

    def blocks(self) -> Iterator[tuple[slice, npt.NDArray[np.float32]]]:
        """Runs of texels and their values, shape (b, n, 3)."""
        for block in self.btf.blocks(_BLOCK):
            values = np.asarray(self.btf.texels(block), np.float32)
            if not np.isfinite(values).all():
                runs = f"{block.start} to {block.stop - 1}"
                raise FormatError(f"{self.path}: texels {runs} hold values that are not finite")
            yield block, values
            self._done += block.stop - block.start
            if self._progress:
                self._progress("factoring", self._done, self._total, "")

    def channels(self, colors: Decorrelation) -> Iterator[tuple[slice, npt.NDArray[np.float32]]]:
        """Runs of texels and the channels to be factored, shape (3, b, n)."""
        for block, values in self.blocks():
            channels = np.ascontiguousarray(np.moveaxis(values, -1, 0))
            yield block, colors.from_rgb(np.maximum(channels, np.float32(0.0)))

    def principal_colors(self) -> Decorrelation:
        """The color model that suits the colors of this texture best; one pass."""
        total, products = np.zeros(3), np.zeros((3, 3))
        for _, values in self.blocks():
            flat = np.maximum(values.reshape(-1, 3), 0.0).astype(np.float64)
            total += flat.sum(axis=0)
            products += flat.T @ flat
        count = self.btf.texel_count * self.btf.pair_count
        mean = total / count
        _, vectors = np.linalg.eigh(products / count - np.outer(mean, mean))
        return Decorrelation(ColorModel.PCA, mean, vectors[:, ::-1].T)

    def loss(self, other: Btf) -> Loss:
        """How far another texture is from this one; one pass."""
        wrong, whole, negative = 0.0, 0.0, 0
        for block, values in self.blocks():
            negative += int(np.count_nonzero(values < 0.0))
            whole += float(np.abs(values).sum(dtype=np.float64))
            wrong += float(np.abs(other.texels(block) - values).sum(dtype=np.float64))
        count = 3 * self.btf.texel_count * self.btf.pair_count
        return Loss(wrong / whole if whole else 0.0, negative / count)


def _write_factors(
    file: io.BufferedWriter, source: _Source, colors: Decorrelation, u: list[npt.NDArray[Any]]
) -> None:
    """Matrices of the channels; one pass, in which texels are projected onto `u` as rounded."""
    places = []
    for matrix in u:
        scalar, (rows, k) = matrix.dtype, matrix.shape
        factors = Factors(scalar, k, rows, source.btf.texel_count, file.tell() + _HEAD)
        file.write(pack_factors(factors))
        file.seek(factors.u_start)
        file.write(matrix.tobytes())
        file.seek(factors.end)
        places.append(factors)
    duals = [_dual(matrix) for matrix in u]
    squares = np.zeros((len(u), u[0].shape[1]))
    for block, channels in source.channels(colors):
        for factors, dual, channel, square in zip(places, duals, channels, squares, strict=True):
            sxv = channel @ dual
            if not np.abs(sxv).max() <= largest(factors.scalar):
                raise FormatError(
                    f"{source.path}: values are too large for "
                    f"numbers of {factors.scalar.itemsize} bytes; take more, or a logarithmic model"
                )
            square += np.square(sxv).sum(axis=0, dtype=np.float64)
            file.seek(factors.sxv_start + block.start * sxv.shape[1] * factors.scalar.itemsize)
            file.write(sxv.astype(factors.scalar).tobytes())
    for factors, square in zip(places, squares, strict=True):
        # Nothing is computed from singular values; those of large textures do not fit a half.
        values = np.minimum(np.sqrt(square), np.finfo(factors.scalar).max)
        file.seek(factors.start)
        file.write(values.astype(factors.scalar).tobytes())


_HEAD = len(pack_factors(Factors(SCALARS[2], 1, 1, 1, 0)))


def _dual(u: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """What texels are multiplied by to be nearest to a combination of columns of `u`."""
    exact = u.astype(np.float64)
    return (exact @ np.linalg.pinv(exact.T @ exact, hermitian=True)).astype(np.float32)


def _notes(btf: Btf) -> Header:
    if isinstance(btf, Ubo2014Btf):
        return replace(btf.header, cosine=False)
    nothing = np.zeros((0, 2), np.float32)
    return Header(btf.width, btf.height, nothing, nothing[None], Decorrelation(ColorModel.RGB))


def _grid(btf: Btf, path: str) -> tuple[Angles, Angles]:
    """Angles of views and of the lights of each, shapes (v, 2) and (v, l, 2).

    Runs of pairs with the same view become that view's lights if they all have one length; else
    each pair has a view to itself.
    """
    wi, wo = _angles(btf.wi, path, "light"), _angles(btf.wo, path, "view")
    starts = np.flatnonzero(np.append(True, (btf.wo[1:] != btf.wo[:-1]).any(axis=1)))
    lengths = np.diff(np.append(starts, len(wo)))
    if (lengths != lengths[0]).any():
        starts, lengths = np.arange(len(wo)), np.ones(1, np.int64)
    return wo[starts], wi.reshape(len(starts), int(lengths[0]), 2)


def _angles(directions: Floats, path: str, what: str) -> Angles:
    if not (directions[:, 2] > _HORIZON).all():
        raise FormatError(f"{path}: a {what} is not above the horizon; leave such pairs out")
    theta, phi = to_spherical(split(directions.astype(np.float64)))
    return np.stack([theta, phi], axis=-1).astype(np.float32)
