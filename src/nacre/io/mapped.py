"""Files that lie in memory only as far as they are read."""

from __future__ import annotations

import mmap
import os
import weakref
from pathlib import Path

from nacre.errors import FormatError
from nacre.io.files import PathLike, check_size, file_errors


class MappedFile:
    """A file of at least a byte, mapped into memory to be read.

    A file of the same name that takes its place changes nothing here. One that is overwritten is
    another matter: reading what it has lost would end the process, so call :meth:`check` before. On
    Windows a mapped file can be neither replaced nor removed.

    `limit` is the largest size in bytes. `descriptor` belongs to the file where it is open already:
    a file that has taken its name since is another. Raises FormatError as
    :func:`nacre.io.files.read_bytes`.
    """

    def __init__(self, path: PathLike, limit: int, descriptor: int | None = None) -> None:
        self.path = path
        with file_errors(path):
            if descriptor is None:
                check_size(Path(path), limit)
                self._file = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
            else:
                self._file = os.dup(descriptor)
            weakref.finalize(self, os.close, self._file)
            self._state = self._now()
            self.data = mmap.mmap(self._file, 0, access=mmap.ACCESS_READ)

    def check(self) -> None:
        """Raise FormatError if the file was written to or cut short since it was mapped."""
        if self._now() != self._state:
            raise FormatError(f"{self.path}: has changed since it was read; read it again")

    def release(self) -> None:
        """Give back the memory of what was read, where the system can; it is read anew."""
        if hasattr(mmap, "MADV_DONTNEED"):
            self.data.madvise(mmap.MADV_DONTNEED)

    def _now(self) -> tuple[int, int]:
        """Size and time of change of the mapped file, whatever its name."""
        found = os.fstat(self._file)
        return found.st_size, found.st_mtime_ns

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """None, for a copy of arrays that are mapped holds their numbers."""
        return type(None), ()
