"""What the names of files tell, and what stands in for a name."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

from nacre.errors import FormatError, did_you_mean
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


def chosen(path: PathLike, names: Sequence[str], material: str | None) -> int:
    """Place of the material that a user wants among those of a file, which has one or more.

    `names` are theirs, "" for those without one; `material` is a name, or a number from 1, or None,
    which means the only one. Raises FormatError if there is no such material, or several and none
    is given, or several of this name.
    """
    if material is None and len(names) == 1:
        return 0
    count = f"{len(names)} material{'s' * (len(names) != 1)}"
    known = textwrap.shorten(", ".join(filter(None, names)), 300, placeholder=" ...")
    how = f"give a name or a number from 1 to {len(names)} as --material"
    if material is None:
        raise FormatError(f"{path}: holds {count}; {how}: {known or 'they have no names'}")
    if material in names:
        if (several := names.count(material)) > 1:
            problem = f"{several} materials are named {material[:80]!r}"
            raise FormatError(f"{path}: {problem}; give the number of one as --material")
        return names.index(material)
    if material.isascii() and material.isdecimal() and 1 <= int(material[:9]) <= len(names):
        return int(material[:9]) - 1
    hint = did_you_mean(material, filter(None, names), f"it has {known}" if known else how)
    raise FormatError(f"{path}: has no material {material[:80]!r} among its {len(names)}{hint}")


def guessed_ending(head: bytes) -> str:
    """The ending of a text without a name, if its first bytes suggest one."""
    start = head.lstrip()
    if start.startswith((b"{", b"[")):
        return ".json"
    line = start.split(b"\n")[0]
    return ".csv" if b"," in line and line.isascii() and line.decode().isprintable() else ""
