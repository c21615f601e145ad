"""Temporary folders with what packed files hold, kept while they are used and a little longer."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from nacre.io.files import identity

_IDLE = 1
"""Folders kept that nobody uses: a command identifies a file, then reads it."""


@dataclass(eq=False)
class _Unpacked:
    """What a packed file holds, and how many use it."""

    users: int = 0
    folder: Path | None = None
    file: Path | None = None
    ready: threading.Lock = field(default_factory=threading.Lock)

    def remove(self) -> None:
        if self.folder is not None:  # what is mapped into memory stays readable
            shutil.rmtree(self.folder, ignore_errors=True)


_made: dict[object, _Unpacked] = {}
_changes = threading.Lock()


@contextmanager
def kept(path: Path, unpack: Callable[[Path], Path]) -> Iterator[Path]:
    """The file that `unpack` puts into a folder, if that was not just done for the same path.

    It stays at least as long as the block lasts.
    """
    key = path.absolute(), identity(path)
    with _changes:
        found = _made.setdefault(key, _Unpacked())
        found.users += 1
    try:
        with found.ready:
            if found.file is None or not found.file.is_file():
                found.remove()
                found.folder = Path(tempfile.mkdtemp(prefix="nacre-"))
                found.file = unpack(found.folder)
        yield found.file
    finally:
        with _changes:
            found.users -= 1
            _made[key] = _made.pop(key)  # the last to be removed
        _clear(_IDLE)


def _clear(most: int) -> None:
    """Remove the folders that nobody uses, but for the last ones."""
    with _changes:
        idle = [key for key, one in _made.items() if not one.users]
        gone = [_made.pop(key) for key in idle[: max(0, len(idle) - most)]]
    for one in gone:
        one.remove()


atexit.register(_clear, 0)
