"""What the names of files tell, and what stands in for a name."""

from __future__ import annotations

import re
from pathlib import Path

from nacre.io.files import PathLike

PACKED = (".gz", ".bz2", ".xz", ".zip")
"""Endings of packed files that are read, in lower case."""


def stem(path: PathLike) -> str:
    """Name of a file without its ending, and without that of its packing: `paint` for
    `paint.bsdf`, `paint.bsdf.gz` and `paint.zip`.
    """
    path = Path(path)
    if path.suffix.lower() not in PACKED:
        return path.stem
    inner = Path(path.stem)
    return inner.stem if re.fullmatch(r"\.[A-Za-z]+5?", inner.suffix) else inner.name


def guessed_ending(head: bytes) -> str:
    """The ending of a text without a name, if its first bytes suggest one."""
    start = head.lstrip()
    if start.startswith((b"{", b"[")):
        return ".json"
    line = start.split(b"\n")[0]
    return ".csv" if b"," in line and line.isascii() and line.decode().isprintable() else ""
