"""One process at a time."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

if sys.platform == "win32":
    import msvcrt

    def _acquire(file: IO[bytes], wait: bool) -> None:
        while True:
            try:  # the first byte, whatever has been written; waiting gives up after ten seconds
                file.seek(0)
                msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
                return
            except OSError as error:
                if not wait:
                    raise BlockingIOError from error
else:
    import fcntl

    def _acquire(file: IO[bytes], wait: bool) -> None:
        fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def exclusive(path: Path, wait: bool = True) -> Iterator[None]:
    """Wait until no other process is in a block with the same path, which becomes a file.

    The operating system ends the lock of a process that dies. The file goes at the end of the
    block.

    Parameters
    ----------
    path
        Of the file.
    wait
        Whether to wait, or to raise where another process is in its block.

    Raises
    ------
    BlockingIOError
        If another is, and `wait` is False.
    OSError
        If the file cannot be created, or its file system has no locks.
    """
    while True:
        file = path.open("ab")
        try:
            _acquire(file, wait)
        except BaseException:
            file.close()
            raise
        with suppress(FileNotFoundError):  # the one before us may have removed it
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                break
        file.close()
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        file.close()
