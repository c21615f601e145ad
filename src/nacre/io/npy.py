"""NumPy's `.npy` arrays, read without trust in what their headers promise.

The layout is described in the documentation of :mod:`numpy.lib.format`.
"""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any, cast

import numpy as np
import numpy.lib.format as npy
import numpy.typing as npt

from nacre.errors import FormatError, reason
from nacre.io.files import PathLike
from nacre.io.mapped import MappedFile

MAGIC = npy.MAGIC_PREFIX  # first bytes of every file

_WHOLE, _RATIO = 1 << 26, 8
"""Bytes that an array may unpack to from an archive of any size, and from each of its bytes."""
TEXT_LIMIT = 1024  # most characters of a text


def parse_npy(data: bytes, where: str) -> npt.NDArray[Any]:
    """The array of floating-point numbers in a version 1.0 `.npy` file; read-only.

    A :class:`FormatError`, which starts with `where`, says that the header is damaged, of another
    version or type, or its shape does not need exactly the bytes that follow.
    """
    shape, order, dtype, offset = _header(io.BytesIO(data), len(data), "f", where)
    values = np.frombuffer(data, dtype, offset=offset)
    return values.reshape(shape, order=order)


def parse_text(data: bytes, where: str) -> str:
    """The one text in a version 1.0 `.npy` file, of at most :data:`TEXT_LIMIT` characters.

    Parameters and errors are those of :func:`parse_npy`.
    """
    shape, _, dtype, offset = _header(io.BytesIO(data), len(data), "U", where)
    if shape or len(data) - offset > 4 * TEXT_LIMIT:
        raise FormatError(f"{where}: is not one text of at most {TEXT_LIMIT} characters")
    try:
        encoding = "utf-32-be" if dtype.str.startswith(">") else "utf-32-le"
        return data[offset:].decode(encoding).rstrip("\0")
    except UnicodeDecodeError as error:
        raise FormatError(f"{where}: holds something else than characters") from error


def map_npy(file: MappedFile, offset: int, length: int, where: str) -> npt.NDArray[Any]:
    """As :func:`parse_npy`, from `length` bytes of a mapped file at an offset.

    The array is not always aligned in memory. Call :meth:`MappedFile.check` before it is used.
    """
    try:
        file.data.seek(offset)
        shape, order, dtype, start = _header(cast(IO[bytes], file.data), length, "f", where)
        if not math.prod(shape):
            return np.zeros(shape, dtype)
        return np.ndarray(shape, dtype, file.data, offset + start, order=order)
    except (TypeError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{where}: cannot be read: {reason(error)}") from error


@contextmanager
def archive_errors(path: PathLike) -> Iterator[None]:
    """A block that reads an archive; a :class:`FormatError` names the file and what is damaged."""
    try:
        yield
    except FormatError:
        raise
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or reason(error)}") from error
    except Exception as error:
        part = "its content" if isinstance(error, zlib.error | EOFError) else "its list of arrays"
        raise FormatError(
            f"{path}: is not a whole .npz archive: {part} is damaged; copy or download it again"
        ) from error


def unpack_member(
    archive: zipfile.ZipFile, member: zipfile.ZipInfo, size: int, where: str
) -> bytes:
    """Content of a file in an archive of `size` bytes, stored or deflated.

    The content may have eight times as many bytes, and 64 MiB from any archive. A
    :class:`FormatError`, which starts with `where`, says that it is larger, has another length than
    the archive says, or is packed in another way; where the archive is damaged, exceptions are of
    many kinds (see :func:`archive_errors`).
    """
    if member.file_size > max(_WHOLE, _RATIO * size):
        raise FormatError(f"{where}: is larger than any table that packs into this file")
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise FormatError(f"{where}: is packed in an unusual way; use numpy.savez")
    with archive.open(member) as packed:  # read() would unpack more than was promised
        content = packed.read(member.file_size)
        if len(content) < member.file_size or packed.read(1):
            raise FormatError(f"{where}: does not have the length that the archive says")
    return content


def _header(
    file: IO[bytes], length: int, kind: str, where: str
) -> tuple[tuple[int, ...], Any, np.dtype[Any], int]:
    """Shape, order ("C" or "F"), type, and length of the header at this place in a file.

    The array must be of one of NumPy's kinds and fill the rest of `length` bytes.
    """
    before = file.tell()
    try:
        if npy.read_magic(file) != (1, 0):
            raise FormatError(f"{where}: is not a version 1.0 .npy file")
        shape, fortran, dtype = npy.read_array_header_1_0(file)
    except FormatError:
        raise
    except Exception as error:  # NumPy's header parser fails in many ways
        raise FormatError(f"{where}: is not a whole .npy file: its header is damaged") from error
    start = file.tell() - before
    left = length - start
    # Wider floats differ between processors, and have patterns that are no number at all.
    if dtype.kind != kind or (kind == "f" and dtype.itemsize > 8):
        wanted = "floats of 16, 32 or 64 bits" if kind == "f" else "text"
        raise FormatError(f"{where}: is of type {dtype}, expected {wanted}")
    if min(shape, default=1) < 0 or math.prod(shape) * dtype.itemsize != left:
        raise FormatError(f"{where}: header promises {shape} {dtype}, {left} bytes follow")
    return shape, "F" if fortran else "C", dtype, start
