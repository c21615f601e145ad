"""Numbers and bytes taken one after another from a binary file, never beyond its end."""

from __future__ import annotations

import struct
from mmap import mmap
from typing import Any

from nacre.errors import CUT_SHORT, FormatError
from nacre.io.files import PathLike


class BinaryReader:
    """A position in a little-endian file that lies in memory or is mapped into it.

    Every method moves on behind what it takes; a :class:`FormatError`, which starts with the path,
    says what the file ends within.
    """

    def __init__(self, data: bytes | mmap, path: PathLike, position: int = 0) -> None:
        self.data, self.path, self.position = data, path, position

    def take(self, layout: str, what: str) -> tuple[Any, ...]:
        """Unpack the next numbers, by a layout of :mod:`struct`."""
        return struct.unpack_from(layout, self.data, self.skip(struct.calcsize(layout), what))

    def bytes(self, length: int, what: str) -> bytes:
        start = self.skip(length, what)
        return bytes(self.data[start : start + length])

    def skip(self, length: int, what: str) -> int:
        """Move on by a number of bytes, of any size; returns the position before."""
        start = self.position
        if start + length > len(self.data):
            raise FormatError(f"{self.path}: ends within {what}; {CUT_SHORT}")
        self.position = start + length
        return start
