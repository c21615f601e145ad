r"""The tensor container of the RGL material database: named arrays in one binary file.

Layout, little-endian throughout: 12 bytes ``tensor_file\0``, two version bytes (1, 0), a uint32
field count; then per field a uint16 name length, the name, a uint16 rank, a uint8 type code, a
uint64 offset of the data from the start of the file, and `rank` uint64 sizes.
"""

from __future__ import annotations

import math
import struct
from mmap import mmap
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import CUT_SHORT, FormatError
from nacre.io.binary import BinaryReader
from nacre.io.files import PathLike, atomic_path, read_bytes

MAGIC = b"tensor_file\0"  # first bytes of every tensor file

SIZE_LIMIT = 1 << 31
"""Largest file read, in bytes; the largest published table is about a tenth of it."""

_VERSION = (1, 0)
_FIELD_LIMIT = 256
_RANK_LIMIT = 8
_NAME_LIMIT = 256
_TYPES = "u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8"
_DTYPES = dict(enumerate(_TYPES, start=1))
_CODES = {np.dtype(name): code for code, name in _DTYPES.items()}

Tensors: TypeAlias = dict[str, npt.NDArray[Any]]


def read_tensors(path: PathLike) -> Tensors:
    """Every field of a tensor file: read-only arrays by name, in the order of the file.

    A :class:`FormatError` says that it is no tensor file, or that a field does not lie within it.
    """
    return parse_tensors(read_bytes(path, SIZE_LIMIT), path)


def parse_tensors(data: bytes | mmap, path: PathLike) -> Tensors:
    """As :func:`read_tensors`, from a file's content: the arrays are views of it."""
    if data[: len(MAGIC)] != MAGIC:
        raise FormatError(f"{path}: does not start with 'tensor_file', not an RGL material")
    reader = _Reader(data, path, len(MAGIC))
    version = reader.take("<2B", "version")
    if version != _VERSION:
        raise FormatError(f"{path}: tensor file version {version[0]}.{version[1]}, expected 1.0")
    (count,) = reader.take("<I", "field count")
    if not 1 <= count <= _FIELD_LIMIT:
        raise FormatError(f"{path}: {count} fields, expected 1 to {_FIELD_LIMIT}")
    tensors: Tensors = {}
    for number in range(count):
        name = reader.name(number)
        if name in tensors:
            raise FormatError(f"{path}: field '{name}': appears twice")
        tensors[name] = reader.array(name)
    return tensors


def write_tensors(tensors: Tensors, path: PathLike) -> None:
    """Write a tensor file, whole or not at all, of arrays that are not empty; always the same
    bytes.
    """
    arrays = {name: np.ascontiguousarray(array) for name, array in tensors.items()}
    offset = len(MAGIC) + struct.calcsize("<2BI")
    offset += sum(struct.calcsize("<HHBQ") + len(n) + 8 * a.ndim for n, a in arrays.items())
    header = MAGIC + struct.pack("<2BI", *_VERSION, len(arrays))
    for name, array in arrays.items():
        header += struct.pack("<H", len(name)) + name.encode("ascii")
        header += struct.pack("<HBQ", array.ndim, _CODES[array.dtype.newbyteorder("<")], offset)
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        offset += array.nbytes
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(header)
        for array in arrays.values():
            file.write(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes())


class _Reader(BinaryReader):
    def name(self, number: int) -> str:
        """The name that starts an entry."""
        what = f"the name of field {number}"
        (length,) = self.take("<H", what)
        raw = self.bytes(length, what)
        if length > _NAME_LIMIT:
            raise FormatError(f"{self.path}: {what} has {length} characters; the file is damaged")
        if not raw.isascii() or not raw.decode("ascii").isidentifier():
            raise FormatError(f"{self.path}: {what} is not an identifier")
        return raw.decode("ascii")

    def array(self, name: str) -> npt.NDArray[Any]:
        """The rest of an entry, and the array it points to."""
        where = f"{self.path}: field '{name}'"
        rank, code, offset = self.take("<HBQ", f"field '{name}'")
        if rank > _RANK_LIMIT:
            raise FormatError(f"{where}: {rank} dimensions, at most {_RANK_LIMIT} are read")
        if code not in _DTYPES:
            raise FormatError(f"{where}: unknown type code {code}")
        shape = self.take(f"<{rank}Q", f"field '{name}'")
        dtype = np.dtype(_DTYPES[code])
        size = math.prod(shape) * dtype.itemsize  # Python integers: cannot overflow
        if size == 0:
            raise FormatError(f"{where}: is empty, shape {shape}")
        if offset + size > len(self.data):
            raise FormatError(
                f"{where}: {size} bytes at offset {offset} reach past the end of the file "
                f"({len(self.data)} bytes); {CUT_SHORT}"
            )
        return np.frombuffer(self.data, dtype, math.prod(shape), offset).reshape(shape)
