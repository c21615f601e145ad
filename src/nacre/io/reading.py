"""What readers are told about files beside their content, by everything that loads in a block.

A command is told once which material of a file is meant or what the columns of a table hold; it
then loads the file wherever it needs it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nacre.io.files import PathLike

_told: dict[Path, Mapping[str, Any]] = {}
"""Options of :func:`nacre.load` by the absolute path of the file, for all threads."""


@contextmanager
def reading(options: Mapping[Path, Mapping[str, Any]]) -> Iterator[None]:
    """A block in which files are read with options of :func:`nacre.load`, by their paths; what a
    call of it is given counts for more.
    """
    global _told
    before = _told
    _told = before | {Path(path).absolute(): given for path, given in options.items()}
    try:
        yield
    finally:
        _told = before


def told(path: PathLike) -> dict[str, Any]:
    """The options for a file."""
    return dict(_told.get(Path(path).absolute(), {}))
