"""The registry of file formats, and load() and save() over it."""

from __future__ import annotations

import hashlib
import stat
from collections.abc import Callable
from pathlib import Path

from nacre.brdf import Brdf
from nacre.files import HEAD, Format, FormatError, PathLike
from nacre.measured import FORMATS as MEASURED
from nacre.neural.file import FORMAT as NEURAL
from nacre.neural.published import FORMATS as PUBLISHED

_formats: list[Format] = [NEURAL, *MEASURED, *PUBLISHED]


def formats() -> tuple[Format, ...]:
    """Every known format."""
    return tuple(_formats)


def register(entry: Format) -> None:
    """Add a format; it is asked before those already known."""
    _formats.insert(0, entry)


def load(path: PathLike) -> Brdf:
    """Read a reflectance from any known file.

    The reader is picked by content; the file name decides only between readers that both
    recognise the content, and for formats whose content starts with nothing to recognise.

    Parameters
    ----------
    path
        A measured table or a neural material.

    Raises
    ------
    FormatError
        If the file is absent, of no known format, or damaged.
    """
    path = Path(path)
    head = _head(path)
    suffix = path.suffix.lower()
    known = [entry for entry in _formats if entry.recognise and entry.recognise(head)]
    if not known:
        known = [e for e in _formats if e.recognise is None and suffix in e.extensions]
    if not known:
        endings = ", ".join(e for entry in _formats for e in entry.extensions)
        raise FormatError(f"{path}: content is of no known format (known: {endings})")
    named = [entry for entry in known if suffix in entry.extensions]
    brdf: Brdf = (named or known)[0].load(path)
    brdf.source = {"file": path.name, "sha256": _digest(path)}
    brdf.name = brdf.name or path.stem
    return brdf


def save(brdf: Brdf, path: PathLike) -> None:
    """Write a reflectance to the format that the file name ends in.

    Parameters
    ----------
    brdf
        A neural material for `.safetensors` and `.h5`; any reflectance for tables.
    path
        File to write; replaced only by a whole new one.

    Raises
    ------
    FormatError
        If no format with this ending can be written, or not from this reflectance.
    """
    writer(path)(brdf, Path(path))


def writer(path: PathLike) -> Callable[[Brdf, Path], None]:
    """The function that writes what a file name ends in.

    Raises
    ------
    FormatError
        If there is none.
    """
    suffix = Path(path).suffix.lower()
    for entry in _formats:
        if suffix in entry.extensions and entry.save is not None:
            return entry.save
    endings = ", ".join(e for entry in _formats if entry.save for e in entry.extensions)
    raise FormatError(f"{path}: no format to write ends in {suffix!r} (known: {endings})")


def _head(path: Path) -> bytes:
    """The first bytes of a regular file."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            kind = "a directory" if path.is_dir() else "not a regular file"
            raise FormatError(f"{path}: is {kind}, expected a file")
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror}") from error
    if not head:
        raise FormatError(f"{path}: is empty")
    return head


def _digest(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror}") from error
