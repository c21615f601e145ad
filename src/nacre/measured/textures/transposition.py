"""From pictures, one per pair of directions, to texels with all their directions."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf, Indices
from nacre.errors import FormatError, reason
from nacre.io.files import PathLike
from nacre.runtime.progress import Progress

_MEMORY = 1 << 28
_T = TypeVar("_T")


class _TransposedBtf(Btf):
    """Texels from parts of a table, each with all texels at some pairs; pictures as they were."""

    def __init__(self, btf: Btf, parts: list[npt.NDArray[Any]]) -> None:
        super().__init__(btf.width, btf.height, btf.wi, btf.wo, name=btf.name, source=btf.source)
        self._btf, self._parts = btf, parts

    def texels(self, chosen: Indices | slice) -> Floats:
        found = [part[chosen] for part in self._parts]
        return np.concatenate(found, axis=1, dtype=np.float32)

    def images(self, chosen: Indices | slice) -> Floats:
        return self._btf.images(chosen)


class TooLargeError(FormatError):
    """A value that does not fit the type it is to have."""


@contextmanager
def transposed(
    btf: Btf,
    folder: PathLike | None = None,
    dtype: npt.DTypeLike | None = None,
    size_limit: int = _MEMORY,
    progress: Progress | None = None,
) -> Iterator[Btf]:
    """The same texture with texels that come at once, while the block lasts.

    Where it lies in images (:attr:`Btf.by_image`), each is read once: as many as `size_limit` bytes
    of memory take are put by texel and written to a temporary file, from which a run of texels is
    one piece of each such part. The file, in `folder` or the system's, has the type `dtype`: by
    default half, or single if a value needs it, and images are read again then. A FormatError says
    that an image is bad, a value is too large for the type, or the file cannot be written.
    """
    if not btf.by_image:
        yield btf
        return
    place = folder or tempfile.gettempdir()

    def transposed(dtype: np.dtype[Any]) -> Btf:
        step = max(1, size_limit // (3 * (4 + dtype.itemsize) * btf.texel_count))
        try:
            table = _table(btf, place, dtype, step, progress)
        except OSError as error:
            cause = error.strerror or reason(error)
            raise FormatError(f"{place}: temporary file cannot be written: {cause}") from error
        size = 3 * step * btf.texel_count
        parts = np.split(table, range(size, len(table), size))
        return _TransposedBtf(btf, [part.reshape(btf.texel_count, -1, 3) for part in parts])

    yield narrowest_precision(transposed, dtype)


def _table(
    btf: Btf, place: PathLike, dtype: np.dtype[Any], step: int, progress: Progress | None
) -> npt.NDArray[Any]:
    """Values by texel of `step` pictures after the other, in a file that vanishes with them."""
    with tempfile.TemporaryFile(dir=place) as file:
        for start in range(0, btf.pair_count, step):
            pictures = btf.images(slice(start, min(start + step, btf.pair_count)))
            by_pair = pictures.reshape(len(pictures), -1, 3)
            file.write(narrowed(by_pair.swapaxes(0, 1), dtype, btf.name).data)
            if progress:
                progress("reading images", start + len(pictures), btf.pair_count, "")
        file.flush()
        return np.memmap(file, dtype, "r")


def narrowest_precision(attempt: Callable[[np.dtype[Any]], _T], dtype: npt.DTypeLike | None) -> _T:
    """What is made in a type or, where that is None, in half or, if a value needs it, single."""
    if dtype is not None:
        return attempt(np.dtype(dtype))
    try:
        return attempt(np.dtype("<f2"))
    except TooLargeError:
        return attempt(np.dtype("<f4"))


def narrowed(values: Floats, dtype: npt.DTypeLike, where: str) -> npt.NDArray[Any]:
    """Finite values in another type, contiguous; a TooLargeError says that one does not fit."""
    with np.errstate(over="ignore"):
        result = values.astype(dtype, order="C")
    if not np.isfinite(result).all():
        problem = f"some are too large for {result.dtype}; ask for single precision"
        raise TooLargeError(f"{where}: values: {problem}")
    return result
