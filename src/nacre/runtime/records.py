"""Records of equal size in a file that only grows: the state of long work that is done in parts.

The first line is JSON with a fingerprint; behind it lie records, each after its checksum. What was
added costs nothing again, and loading runs no code.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from io import FileIO
from pathlib import Path

from nacre.errors import NacreError
from nacre.io.files import check_regular, file_errors, write_encoded
from nacre.runtime.store import readable

_KEY = "nacre records"
_LONGEST = 1 << 16  # bytes of the first line
_CHECKSUM = struct.Struct("<I")  # CRC-32 of a record


class Records:
    """Records of `size` bytes each in a file, all of one piece of work.

    Without a path, nothing is kept. A file with another `fingerprint` or size is refused: they
    stand for what must be the same for the work to continue.
    """

    def __init__(self, path: Path | None, fingerprint: str, size: int) -> None:
        self.path, self.size = path, size
        self._head = {_KEY: {"fingerprint": fingerprint, "size": size}}
        self._frame = _CHECKSUM.size + size

    def load(self) -> Iterator[bytes]:
        """The records that are whole, in the order they were added; none if there is no file.

        A record that was cut short or has changed is left out. A :class:`NacreError` says what to
        remove if the file is no such file, or belongs to other work.
        """
        if self.path is None or not self.path.exists():
            return
        with readable(self.path):
            check_regular(self.path)
            file = self.path.open("rb")
        with file:
            with readable(self.path):
                found = json.loads(file.readline(_LONGEST))[_KEY]
            if found != self._head[_KEY]:
                raise NacreError(f"{self.path}: belongs to another run; remove it to start over")
            while len(frame := file.read(self._frame)) == self._frame:
                record = frame[_CHECKSUM.size :]
                if _CHECKSUM.pack(zlib.crc32(record)) == frame[: _CHECKSUM.size]:
                    yield record

    def add(self, records: Iterable[bytes]) -> None:
        """Add records behind the last whole one; a file that is not there is made, even for none.

        They are on disk when this returns. A :class:`FormatError` says that they cannot be written;
        the file then has what it had.
        """
        if self.path is None:
            return
        if not self.path.exists():
            write_encoded(self.path, self._first_line, self._head, internal=True)
        with file_errors(self.path, "written"), self.path.open("r+b", buffering=0) as file:
            end = self._end(file)
            file.seek(end)
            try:
                for record in records:
                    left = memoryview(_CHECKSUM.pack(zlib.crc32(record)) + record)
                    while left:
                        left = left[file.write(left) :]
                os.fsync(file.fileno())
            except OSError:
                with suppress(OSError):
                    os.truncate(self.path, end)
                raise

    def _end(self, file: FileIO) -> int:
        """Where the last record ends, but for one that was cut short."""
        first = len(self._first_line(self._head))
        size = file.seek(0, os.SEEK_END)
        return max(first, size - (size - first) % self._frame)

    @staticmethod
    def _first_line(head: object) -> bytes:
        return json.dumps(head).encode() + b"\n"
