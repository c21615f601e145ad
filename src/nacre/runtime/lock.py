"""One process at a time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout


@contextmanager
def exclusive(path: Path, wait: bool = True) -> Iterator[None]:
    """Wait until no other process is in a block with the same path, which becomes a file.

    The operating system ends the lock of a process that dies. The file is removed at the end of the
    block. Without `wait`, a BlockingIOError says that another process is in its block; any other
    OSError that the file cannot be created, or its file system has no locks.
    """
    lock = FileLock(path, thread_local=False)
    try:
        lock.acquire(blocking=wait)
    except Timeout as error:
        raise BlockingIOError from error
    try:
        yield
    finally:
        with suppress(OSError):  # while it is held: whoever waits sees that it is gone
            path.unlink()
        lock.release()
