"""Rows of cells of a text file or a spreadsheet, and the line among them that names columns."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from nacre.errors import FormatError
from nacre.io.files import PathLike, check_size, file_errors, first_bytes
from nacre.io.text_file import parse_number, read_lines

_SIZE_LIMIT = 1 << 28
_SHEET_LIMIT = 1 << 26
_CELL_LIMIT = 1 << 22  # cells of a sheet
_PREAMBLE = 1000  # most lines before the names of columns
_COLUMNS = 4096
_REMARKS = 20


@dataclass(frozen=True)
class Rows:
    """A table of text."""

    names: list[str]
    cells: Iterator[tuple[int, list[str]]]
    """Numbers of lines, from 1, and cells; empty lines and comments are left out."""
    remarks: list[str]
    """Lines before the names, as far as they are short."""
    decimal_comma: bool


def read_rows(path: PathLike, sheet: str | None) -> Rows:
    """The table in a file.

    A FormatError says that the file cannot be read, or that no line names the columns of numbers
    that follow it.
    """
    if first_bytes(path).startswith(b"PK"):
        lines = _sheet_rows(path, sheet)
        return _table(path, lines, decimal_comma=False)
    if sheet is not None:
        raise FormatError(f"{path}: sheet: is for spreadsheets; leave it out")
    separator, comma = _separator(path)
    lines = (
        (number, [cell.strip().strip('"').strip() for cell in _split(line, separator)])
        for number, line in read_lines(path, _SIZE_LIMIT)
        if line.strip() and not line.lstrip().startswith("#")
    )
    return _table(path, lines, decimal_comma=comma)


def _table(path: PathLike, lines: Iterator[tuple[int, list[str]]], *, decimal_comma: bool) -> Rows:
    remarks: list[str] = []
    before: tuple[int, list[str]] | None = None
    for number, row in itertools.islice(lines, _PREAMBLE):
        cells = _trimmed(row)
        if before is not None and _is_data(before[1], cells, decimal_comma):
            names = before[1]
            if len(names) > _COLUMNS:
                raise FormatError(f"{path}: {len(names)} columns, at most {_COLUMNS} are read")
            rest = itertools.chain([(number, cells)], ((n, _trimmed(r)) for n, r in lines))
            return Rows(names, rest, remarks, decimal_comma)
        if before is not None and len(remarks) < _REMARKS:
            remarks.append(" ".join(before[1])[:300])
        before = number, cells
    raise FormatError(
        f"{path}: has no line that names columns before lines of numbers, or is something else; "
        "expected one like theta_i,phi_i,theta_o,phi_o,r,g,b"
    )


def _is_data(names: Sequence[str], cells: Sequence[str], comma: bool) -> bool:
    """Whether a line of cells is numbers, and the line before it names them."""
    if len(cells) < 3 or len(cells) != len(names):
        return False
    named = sum(not _is_number(name, comma) for name in names)
    filled = [cell for cell in cells if cell]
    return named >= 2 and len(filled) >= 3 and all(_is_number(cell, comma) for cell in filled)


def _is_number(cell: str, comma: bool) -> bool:
    try:
        number(cell, comma)
    except ValueError:
        return False
    return True


def number(cell: str, comma: bool) -> float:
    """The number in a cell; a ValueError says that it is none."""
    return parse_number(cell.replace(",", ".") if comma else cell)


def _trimmed(row: list[str]) -> list[str]:
    end = len(row)
    while end and not row[end - 1]:
        end -= 1
    return row[:end]


def _split(line: str, separator: str | None) -> list[str]:
    return line.split() if separator is None else line.rstrip("\r\n").split(separator)


def _separator(path: PathLike) -> tuple[str | None, bool]:
    """What parts the cells of a text, None for blanks, and whether decimals have a comma."""
    lines = [line for _, line in itertools.islice(read_lines(path, _SIZE_LIMIT), 200)]
    numbers = [line for line in lines if re.search(r"\d", line)]
    for mark in "\t;":
        rows = [line for line in numbers if line.count(mark) >= 2]
        if len(rows) <= len(numbers) // 2:
            continue
        comma = [line for line in rows if re.search(r"\d,\d", line)]
        point = [line for line in rows[1:] if re.search(r"\d\.\d", line)]
        if comma and point:
            problem = "decimals with ',' and with '.', use one"
            raise FormatError(f"{path}: {problem}: {comma[0].strip()[:60]!r}")
        return mark, bool(comma)
    if sum(line.count(",") >= 2 for line in numbers) > len(numbers) // 2:
        return ",", False
    return None, False


def _sheet_rows(path: PathLike, sheet: str | None) -> Iterator[tuple[int, list[str]]]:
    import openpyxl

    with file_errors(path):
        check_size(Path(path), _SHEET_LIMIT)
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    except Exception as error:  # it raises errors of zip files, XML and its own
        raise FormatError(f"{path}: is not a whole spreadsheet ({type(error).__name__})") from error
    if sheet is not None and sheet not in book.sheetnames:
        known = ", ".join(book.sheetnames)[:200]
        raise FormatError(f"{path}: sheet: there is no {sheet[:80]!r} (known: {known})")
    chosen = book[sheet] if sheet is not None else book[book.sheetnames[0]]
    count = 0
    try:
        for index, row in enumerate(chosen.iter_rows(values_only=True), 1):
            count += len(row)
            if count > _CELL_LIMIT:
                raise FormatError(f"{path}: more than {_CELL_LIMIT} cells; save the table as .csv")
            cells = ["" if value is None else str(value).strip() for value in row]
            if any(cells):
                yield index, cells
    except FormatError:
        raise
    except Exception as error:
        raise FormatError(f"{path}: is not a whole spreadsheet ({type(error).__name__})") from error
