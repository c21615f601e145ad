"""Files of readings: comma-separated values, one reading a row.

`instrument` and `geometry` say what was read (:mod:`nacre.instruments.names`), `value` is the
result; a color has `L*`, `a*`, `b*` or `X`, `Y`, `Z` instead, or Y alone, f_r has `r`, `g`, `b`.
`uncertainty`, `illuminant` and `observer` may be missing, in all rows or in some. The columns have
any order; those with other names are remarks. Lines `# illuminant: D65` and `# observer: 10` before
the names of the columns are for all rows. Cells are separated by commas, or by semicolons or tabs;
then numbers may have decimal commas.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from nacre.errors import FormatError, did_you_mean
from nacre.instruments.names import find_quantity
from nacre.instruments.quantities import ColorQuantity, Luminance, Quantity
from nacre.instruments.readings import Reading
from nacre.io.files import PathLike, first_bytes
from nacre.io.text_file import parse_number, read_lines, write_rows

_SIZE_LIMIT = 1 << 22
_MOST = 256  # readings
_COLOR, _XYZ, _RGB = ("L*", "a*", "b*"), ("X", "Y", "Z"), ("r", "g", "b")
_COLUMNS = {
    "instrument": ("instrument", "device", "meter"),
    "geometry": ("geometry", "angle", "mode"),
    "value": ("value", "reading"),
    "L*": ("l*", "l"),
    "a*": ("a*", "a"),
    "b*": ("b*",),
    "X": ("x",),
    "Y": ("y",),
    "Z": ("z",),
    "r": ("r", "red"),
    "g": ("g", "green"),
    "b": ("b", "blue"),
    "uncertainty": ("uncertainty", "sigma", "std", "standard deviation"),
    "illuminant": ("illuminant", "illum"),
    "observer": ("observer", "obs"),
}
"""Columns, and how they are called in files."""


class _Row(NamedTuple):
    line: int
    cells: Mapping[str, str]
    decimal_comma: bool


def is_readings(path: PathLike) -> bool:
    """Whether a file looks like one of readings: its columns begin with the instrument."""
    head = first_bytes(path).decode("utf-8", "replace").lstrip("\ufeff")
    for line in head.splitlines():
        if line.strip() and not line.startswith("#"):
            first = re.split(r"[,;\t]", line)[0].strip().strip('"').lower()
            return first in _COLUMNS["instrument"]
    return False


def load_readings(path: PathLike) -> list[Reading]:
    """Read a file of readings; rows without values are left out.

    Raises FormatError, which names line and column, if the file cannot be read, there is no
    reading, a value is no number or one is missing, or an instrument or a geometry is unknown.
    """
    found = []
    for row in _rows(path):
        reading = _reading(path, row)
        if reading is not None:
            found.append(reading)
        if len(found) > _MOST:
            raise FormatError(f"{path}: more than {_MOST} readings")
    if not found:
        raise FormatError(f"{path}: has no reading; fill in a value")
    return found


def save_readings(
    readings: Sequence[Reading], path: PathLike, to_fill_in: Sequence[Quantity] = ()
) -> None:
    """Write readings, and rows for quantities that are to be read.

    Raises FormatError if the path cannot be written.
    """
    names = ["instrument", "geometry", "value", *_COLOR, *_RGB]
    names += ["uncertainty", "illuminant", "observer"]
    quantities = [*(reading.quantity for reading in readings), *to_fill_in]
    if not any(quantity.components == _RGB for quantity in quantities):
        names = [name for name in names if name not in _RGB]
    if any(isinstance(quantity, Luminance) for quantity in quantities):
        names.insert(names.index("uncertainty"), "Y")
    rows: list[list[str]] = [names]
    for reading in readings:
        values = dict(zip(_named(reading.quantity), reading.values, strict=True))
        values["uncertainty"] = reading.uncertainty
        rows.append(_cells(reading.quantity, names, values))
    rows += [_cells(quantity, names, {}) for quantity in to_fill_in]
    write_rows(rows, path)


def _named(quantity: Quantity) -> tuple[str, ...]:
    """The columns that the values of a quantity are in."""
    return ("Y",) if isinstance(quantity, Luminance) else quantity.components


def _cells(quantity: Quantity, names: Sequence[str], values: Mapping[str, float]) -> list[str]:
    cells = {name: f"{value:.7g}" for name, value in values.items()}
    cells |= {"instrument": quantity.instrument, "geometry": quantity.geometry}
    color = quantity.color if isinstance(quantity, Luminance) else quantity
    if isinstance(color, ColorQuantity):
        cells |= {"illuminant": color.illuminant, "observer": str(color.observer)}
    return [cells.get(name, "") for name in names]


def _rows(path: PathLike) -> Iterator[_Row]:
    """The rows of a table, by names of :data:`_COLUMNS`."""
    names: list[str] | None = None
    given: dict[str, str] = {}
    delimiter = ","
    for number, line in read_lines(path, _SIZE_LIMIT):
        text = line.strip()
        if text.startswith("#"):
            key, _, value = text.lstrip("# ").partition(":")
            if names is None and key.strip().lower() in ("illuminant", "observer"):
                given[key.strip().lower()] = value.strip()
            continue
        if not text.strip(",;\t "):
            continue
        if names is None:
            delimiter = max(",;\t", key=text.count)
        cells = [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter))]
        if names is None:
            names = _header(path, number, cells)
            continue
        if len(cells) > len(names):
            raise FormatError(
                f"{path}: line {number}: has {len(cells)} cells for {len(names)} columns"
            )
        own = {name: cell for name, cell in zip(names, cells, strict=False) if cell}
        yield _Row(number, {**given, **own}, delimiter != ",")
    if names is None:
        raise FormatError(f"{path}: has no columns; the first line names them: instrument, ...")


def _header(path: PathLike, number: int, cells: Sequence[str]) -> list[str]:
    """Names of columns as in :data:`_COLUMNS`, others as they are."""
    known = {spelling: name for name, spellings in _COLUMNS.items() for spelling in spellings}
    written = [cell.lower() for cell in cells]
    if "b*" not in written and "l" in (cell.rstrip("*") for cell in written):
        known["b"] = "b*"
    names = [known.get(cell, cell) for cell in written]
    for cell, name in zip(cells, names, strict=True):
        if name in _COLUMNS and names.count(name) > 1:
            raise FormatError(f"{path}: columns: {name} appears twice")
        long = [column for column in _COLUMNS if len(column) > len(_COLOR)]
        if name not in _COLUMNS and (close := did_you_mean(name, long)):
            raise FormatError(f"{path}: line {number}: column {cell[:40]!r} is unknown{close}")
    if "instrument" not in names:
        raise FormatError(f"{path}: columns: instrument missing")
    return names


def _reading(path: PathLike, row: _Row) -> Reading | None:
    """The reading in a row, None if it has no value."""
    where = f"{path}: line {row.line}"
    cells = row.cells
    kinds = (("value",), _COLOR, _XYZ, _RGB)
    filled = [kind for kind in kinds if any(name in cells for name in kind)]
    if not filled:
        return None
    if len(filled) > 1:
        several = " and ".join("/".join(kind) for kind in filled)
        raise FormatError(f"{where}: has {several}; one reading has one of these")
    (names,) = filled
    words = (cells.get(key, "") for key in ("instrument", "geometry", "illuminant", "observer"))
    try:
        quantity = find_quantity(*words)
    except ValueError as error:
        raise FormatError(f"{where}: {error}") from error
    if names == _XYZ and set(names) & set(cells) == {"Y"}:
        names = ("Y",)
    numbers = [_number(where, name, row) for name in names]
    expected = quantity.components if not isinstance(quantity, ColorQuantity) else _COLOR
    if isinstance(quantity, ColorQuantity) and names == _XYZ:
        numbers = quantity.shown(quantity.from_xyz(np.array(numbers))).tolist()
    elif isinstance(quantity, ColorQuantity) and names == ("Y",):
        quantity = Luminance(quantity)
    elif names != expected:
        raise FormatError(f"{where}: {quantity.name} is read as {', '.join(expected)}")
    if names != _COLOR and min(numbers) < 0.0 and not isinstance(quantity, ColorQuantity):
        raise FormatError(f"{where}: column {names[0]}: is below 0")
    if names == _COLOR and not 0.0 <= numbers[0] <= 1000.0:
        raise FormatError(f"{where}: column L*: must be from 0 to 1000")
    values = tuple(numbers)
    uncertainty = quantity.uncertainty(values)
    if "uncertainty" in cells:
        uncertainty = _uncertainty(where, row, max(map(abs, values)))
    if not uncertainty > 0.0:
        raise FormatError(f"{where}: column uncertainty: must be above 0")
    return Reading(quantity, values, uncertainty)


def _uncertainty(where: str, row: _Row, largest: float) -> float:
    """The standard deviation in a row, which may be a percentage of the largest value."""
    text = row.cells["uncertainty"]
    if not text.endswith("%"):
        return _number(where, "uncertainty", row)
    cells = {**row.cells, "uncertainty": text.removesuffix("%").strip()}
    return 0.01 * _number(where, "uncertainty", row._replace(cells=cells)) * largest


def _number(where: str, name: str, row: _Row) -> float:
    text = row.cells.get(name, "")
    if not text:
        raise FormatError(f"{where}: column {name}: is empty")
    try:
        return parse_number(text.replace(",", ".") if row.decimal_comma else text)
    except ValueError as error:
        raise FormatError(f"{where}: column {name}: {text[:40]!r} is no number") from error
