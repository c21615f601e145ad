"""Text files, read line by line without trust in their length or encoding."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence

from nacre.errors import FormatError
from nacre.io.files import PathLike, read_bytes, write_encoded

LINE_LIMIT = 1 << 16  # most characters in a line
_BINARY = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")  # no text has these


def read_lines(path: PathLike, size_limit: int) -> Iterator[tuple[int, str]]:
    """Numbers of lines, from 1, and lines of a text file, whatever ends them.

    UTF-8, UTF-16 with a byte order mark, which is left out, or, as instruments write it, one byte a
    character (Windows-1252). Lines come one at a time: a list of them could take many times the
    memory of the file. Raises :class:`FormatError` if the file has more bytes than `size_limit`, is
    no text, or, once it is reached, for a line longer than :data:`LINE_LIMIT`.
    """
    data = read_bytes(path, size_limit)
    return _lines(path, data, _encoding(path, data))


def _encoding(path: PathLike, data: bytes) -> str:
    if data.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        raise FormatError(f"{path}: is UTF-32; save it as UTF-8")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif b"\0" in data:
        raise FormatError(f"{path}: is not text, or is UTF-16 without its mark; save it as UTF-8")
    else:
        encoding = "utf-8-sig"
    try:
        data.decode(encoding)
    except UnicodeDecodeError as error:
        if encoding == "utf-16" or _BINARY.search(data):
            raise FormatError(
                f"{path}: byte {error.start} is not text; save it as UTF-8"
            ) from error
        return "windows-1252"
    return encoding


def _lines(path: PathLike, data: bytes, encoding: str) -> Iterator[tuple[int, str]]:
    text = io.TextIOWrapper(io.BytesIO(data), encoding=encoding, errors="replace")
    for number in range(1, len(data) + 2):
        line = text.readline(LINE_LIMIT + 1)
        if len(line) > LINE_LIMIT:
            raise FormatError(f"{path}: line {number}: is longer than {LINE_LIMIT} characters")
        if not line:
            return
        yield number, line


def parse_number(cell: str) -> float:
    """The number in a cell.

    Raises ValueError, with the cell as its text, if it is none, has digits of another script or
    grouped as in Python, or is not finite.
    """
    try:
        value = float(cell) if cell.isascii() and "_" not in cell else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(cell)
    return value


def parse_numbers(words: Iterable[str], where: str) -> list[float]:
    """The numbers that words are; a FormatError, which starts with `where`, names one that is
    none.
    """
    try:
        return [parse_number(word) for word in words]
    except ValueError as error:
        raise FormatError(f"{where}: {str(error)[:40]!r} is no number") from error


def check_columns(path: PathLike, names: Sequence[str], needed: Iterable[str]) -> None:
    """Refuse a table that lacks a column, or has one twice."""
    if missing := [name for name in needed if name not in names]:
        raise FormatError(f"{path}: columns: {', '.join(missing)} missing")
    if twice := [name for name in names if names.count(name) > 1]:
        raise FormatError(f"{path}: columns: {twice[0][:40]!r} appears twice")


def write_rows(rows: Iterable[Iterable[object]], path: PathLike, about: str = "") -> None:
    """Write comma-separated values, the names of the columns first, whole or not at all.

    A line of a comment before them says what they are `about`, if given.
    """
    text = io.StringIO(f"# {about}\n" if about else "", newline="")
    text.seek(0, io.SEEK_END)
    csv.writer(text, lineterminator="\n").writerows(rows)
    write_encoded(path, str.encode, text.getvalue())
