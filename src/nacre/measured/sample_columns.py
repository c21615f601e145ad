"""The grammar of files of scattered samples: header lines, names of columns, rows of numbers.

Columns may be parted by commas, semicolons, tabs or blanks, whichever the line that names them has;
where it is not a comma, decimals may be written with one. The grammar is in
docs/reference/formats.md.
"""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import FormatError
from nacre.io.files import PathLike
from nacre.io.text_file import check_columns, parse_number

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
"""Columns of the directions to the light and to the viewer."""

Lines: TypeAlias = Iterator[tuple[int, str]]  # numbers of lines, from 1, and lines

_COLUMN_LIMIT = 1024
_HEADER_LIMIT = 1000
_NAME_LIMIT = 100
_LARGEST = float(np.finfo(np.float32).max)
_UNITS = {
    **dict.fromkeys(("deg", "degree", "degrees"), math.pi / 180.0),
    **dict.fromkeys(("rad", "radian", "radians"), 1.0),
}
_ALIASES = {
    **{f"{angle}_{end}": f"{angle}_o" for angle in ("theta", "phi") for end in "sr"},
    **dict.fromkeys(("brdf", "bsdf", "f_r"), "f"),
    **{name: name[0] for name in ("red", "green", "blue")},
    **dict.fromkeys(("std", "stdev", "uncertainty"), "sigma"),
}
NOISE = "sigma"  # column of the standard deviation of f_r, in every channel
APERTURES = ("source_aperture", "detector_aperture")
"""Columns of half the angle of the cones that light comes from, and that the detector takes in."""

_COLORS = (["b", "g", "r"], ["x", "y", "z"], ["f"])
_COLUMN = re.compile(r"(?P<name>[^\[\]()]*?)\s*(?:[\[(]\s*(?P<unit>[^\[\]()]*?)\s*[\])])?")
_BAND = re.compile(r"(\d+(?:\.\d+)?)\s*(?:nm)?")


@dataclass(frozen=True)
class Columns:
    names: list[str]
    """ANGLES; r, g, b, or x, y, z, or f, or wavelengths in nm; NOISE and APERTURES if there."""
    scales: dict[str, float]
    """Factor to radians for each of ANGLES and APERTURES; of these, 0 for solid angles in sr."""
    percent: bool  # whether NOISE is relative, in percent
    separator: str | None  # between columns; None for blanks

    @property
    def bands(self) -> list[str]:
        """Names that are wavelengths, shortest first."""
        return sorted((name for name in self.names if _BAND.fullmatch(name)), key=float)


def read_header(path: PathLike, lines: Lines) -> tuple[dict[str, str], Columns]:
    """Pairs of keys (lower case) and values, and the columns; takes no line after their names.

    A :class:`FormatError` says that no line names columns, or which one or which unit is missing.
    """
    pairs: dict[str, str] = {}
    stray = 0
    for number, line in lines:
        stripped = line.strip().strip(",;")  # spreadsheets pad every line with separators
        if stripped.startswith("VARS"):  # ASTM E1392, whose angles are in radians
            return pairs, _columns(path, stripped[4:].lstrip(" \t=:"), {"units": "radians"} | pairs)
        if "theta_i" in stripped.lower() and not stripped.startswith("#"):
            if stray:
                problem = "is neither 'key: value' nor a comment; start it with #"
                raise FormatError(f"{path}: line {stray}: {problem}")
            return pairs, _columns(path, line.strip("\r\n"), pairs)
        if pair := _pair(stripped):
            pairs[pair[0]] = pair[1]
        elif stripped and not stripped.startswith("#"):
            stray = stray or number
        if number >= _HEADER_LIMIT:
            break
    example = f"{','.join(ANGLES)},r,g,b"
    problem = "has no line that names columns, or is something else"
    raise FormatError(f"{path}: {problem}; expected one like {example}")


def read_table(
    path: PathLike, lines: Lines, columns: Columns
) -> tuple[npt.NDArray[np.float64], int]:
    """Numbers in the lines that are left, shape (n, columns), and how many lines had angles only.

    A :class:`FormatError` says that there are none, or which line or value is wrong.
    """
    values, numbers = array("d"), array("q")
    given = {index for index, name in enumerate(columns.names) if name in (*ANGLES, *APERTURES)}
    empty: list[int] = []
    marks: set[str] = set()
    for number, line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if columns.separator != ",":
            marks |= {",", "."} & set(line)
            if len(marks) > 1:
                raise FormatError(f"{path}: line {number}: decimals with ',' and with '.', use one")
            line = line.replace(",", ".")
        cells = _split(line, columns.separator)
        while len(cells) > len(columns.names) and not cells[-1]:
            cells.pop()
        if not any(cells):
            continue
        if len(cells) != len(columns.names):
            counts = f"{len(cells)} values, expected {len(columns.names)}"
            raise FormatError(f"{path}: line {number}: {counts}")
        if {index for index, cell in enumerate(cells) if cell} == given:
            empty.append(number)
            continue
        try:
            values.extend(map(parse_number, cells))
        except ValueError:
            bad = len(values) % len(cells)  # those before it were taken
            where = f"{path}: line {number}: column {columns.names[bad]}"
            raise FormatError(f"{where}: {cells[bad][:40]!r} is not a finite number") from None
        numbers.append(number)
    if empty and not numbers:
        raise FormatError(f"{path}: is a plan that is not filled in, from line {empty[0]} on")
    if not numbers:
        raise FormatError(f"{path}: holds no samples")
    table = np.frombuffer(values, np.float64).reshape(len(numbers), -1)
    good = np.abs(table) <= _LARGEST  # false for NaN
    if not good.all():
        row, column = (int(i) for i in np.argwhere(~good)[0])
        where = f"{path}: line {numbers[row]}: column {columns.names[column]}"
        raise FormatError(f"{where}: {table[row, column]:g} is not a finite number")
    return table, len(empty)


def _pair(line: str) -> tuple[str, str] | None:
    """Key in lower case and value of `# key: value`, `key = value` or, as in ASTM, `KEY value`."""
    text = line.lstrip("#").strip()
    cut = min((at for at in (text.find(":"), text.find("=")) if at > 0), default=0)
    if cut and not {",", "#"} & set(text[:cut]):
        return text[:cut].strip().lower(), text[cut + 1 :].strip()
    word, _, rest = text.partition(" ")
    if rest and word.isidentifier() and word.isupper() and not line.startswith("#"):
        return word.lower(), rest.strip()
    return None


def _split(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(separator)]


def _columns(path: PathLike, line: str, header: dict[str, str]) -> Columns:
    """Names of the columns, bands as numbers, and the factor from each angle to radians."""
    separator = next((mark for mark in ";\t," if mark in line), None)
    cells = _split(line.lower(), separator)
    while cells and not cells[-1]:
        cells.pop()
    if len(cells) > _COLUMN_LIMIT:
        raise FormatError(f"{path}: {len(cells)} columns, at most {_COLUMN_LIMIT} are read")
    names: list[str] = []
    scales: dict[str, float] = {}
    percent = False
    for cell in cells:
        match = _COLUMN.fullmatch(cell) if len(cell) <= _NAME_LIMIT else None
        name, unit = (match["name"], match["unit"]) if match else (cell, None)
        name = _ALIASES.get(name, name)
        band = _BAND.fullmatch(name)
        names.append(band[1] if band else name)
        if name in ANGLES:
            scales[name] = _scale(path, name, unit or header.get("units"))
        elif name in APERTURES:
            solid = (unit or "").strip().lower() == "sr"
            scales[name] = 0.0 if solid else _scale(path, name, unit or header.get("units"))
        elif name == NOISE:
            percent = unit == "%"
    check_columns(path, names, ANGLES)
    columns = Columns(names, scales, percent, separator)
    values = [name for name in names if name not in (*ANGLES, NOISE, *APERTURES)]
    if sorted(values) in _COLORS:
        return columns
    if not values or len(columns.bands) < len(values):
        found = ", ".join(values)[:80] or "none"
        raise FormatError(
            f"{path}: columns: beside the angles there must be r, g, b, or x, y, z, or f, or "
            f"wavelengths in nm; found {found}"
        )
    bands = {float(name) for name in values}
    if len(bands) < len(values) or not all(1.0 <= band <= 1e6 for band in bands):
        raise FormatError(f"{path}: columns: wavelengths must differ and be 1 to 1,000,000 nm")
    return columns


def _scale(path: PathLike, name: str, unit: str | None) -> float:
    if unit is None:
        raise FormatError(
            f"{path}: column {name}: has no unit; name it '{name} [deg]' or '{name} [rad]', or "
            "add a line '# units: degrees'"
        )
    if unit.strip().lower() not in _UNITS:
        raise FormatError(f"{path}: column {name}: unit {unit[:40]!r}, expected degrees or radians")
    return _UNITS[unit.strip().lower()]
