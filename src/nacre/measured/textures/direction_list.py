"""Directions as people name them: those of a dome, or a list in a file.

A list is UTF-8 text with comma-separated values (or semicolons or tabs). Its first line names the
columns, in any order. Pairs of a light and a view have unit vectors lx, ly, lz, vx, vy, vz, or
angles in degrees theta_l, phi_l, theta_v, phi_v; a list with theta, phi has directions that each
serve as light and as view. Lists of photographs (:mod:`nacre.measured.textures.photographs`) have
columns file and, if wanted, quantity and scale too. Lines that start with # do not matter.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import FormatError, did_you_mean
from nacre.io.files import PathLike
from nacre.io.text_file import check_columns, parse_number, read_lines
from nacre.measured.textures.directions import (
    PAIR_LIMIT,
    check_directions,
    check_distinct,
    from_degrees,
)
from nacre.measured.textures.domes import BONN, UTIA, below, pairs

DOMES = {"bonn": BONN, "utia": UTIA}  # by the names that commands take, in lower case

Rows = list[tuple[int, dict[str, str]]]  # number, and cells by column, of each line

_SIZE_LIMIT = 1 << 26
_VECTORS = ("lx", "ly", "lz", "vx", "vy", "vz")
_ANGLES = ("theta_l", "phi_l", "theta_v", "phi_v")
_EACH = ("theta", "phi")
_LOOSE = 0.02  # how far a vector's length may be from 1: few decimals are given at times


def named_directions(source: str, steepest: float = 90.0) -> tuple[Floats, Floats]:
    """Pairs of directions of a dome, every light with every view, or from a list; shapes (n, 3).

    The source is `bonn` or `utia`, in any case, or the path of a list; `steepest` is the largest
    polar angle in degrees. A :class:`FormatError` says that there is no such dome or list; a column
    is missing, unknown or there twice; a value is not a finite number; a polar angle is negative; a
    direction is not of unit length, lies below the horizon or is too steep; or pairs appear twice
    or are too many.
    """
    if source.lower() in DOMES:
        return DOMES[source.lower()].pairs()
    path = Path(source)
    if not path.suffix and not path.exists():
        problem = f"is neither a dome ({', '.join(DOMES)}) nor a list (.csv)"
        raise FormatError(f"{source}: {problem}{did_you_mean(source, DOMES)}")
    rows = read_rows(path)
    wi, wo = row_pairs(path, rows)
    steep = ~(below(wi, steepest) & below(wo, steepest))
    if steep.any():
        where = f"{path}: line {rows[int(steep.argmax())][0]}"
        raise FormatError(f"{where}: a polar angle is above {steepest:g} degrees; leave it out")
    return (wi, wo) if "theta" not in rows[0][1] else pairs(wi, wo)


def read_rows(path: PathLike, *, images: bool = False) -> Rows:
    """Lines of a list after the one that names the columns, which must be the right ones.

    For a list of photographs (`images`) these are pairs with a column `file`. A
    :class:`FormatError` says which column or line does not belong to such a list.
    """
    columns: list[str] = []
    rows: Rows = []
    separator = ","
    for number, line in read_lines(path, _SIZE_LIMIT):
        if not line.strip() or line.startswith("#"):
            continue
        if not columns:
            separator = next((mark for mark in ";\t" if mark in line), ",")
        cells = _cells(path, number, line, separator)
        if not columns:
            columns = [cell.lower() for cell in cells]
            _check_columns(path, columns, images)
            continue
        if len(cells) != len(columns):
            raise FormatError(f"{path}: line {number}: {len(cells)} values, not {len(columns)}")
        if len(rows) == PAIR_LIMIT:
            raise FormatError(f"{path}: has more than {PAIR_LIMIT} lines")
        rows.append((number, dict(zip(columns, cells, strict=True))))
    if not rows:
        raise FormatError(f"{path}: lists {'no images' if images else 'no directions'}")
    return rows


def row_pairs(path: PathLike, rows: Rows) -> tuple[Floats, Floats]:
    """Checked directions of all rows: lights and views, twice the same for a list of theta, phi."""
    columns = rows[0][1]
    names = next(form for form in (_VECTORS, _ANGLES, _EACH) if form[0] in columns)
    count = len(rows) ** 2 if names is _EACH else len(rows)
    if count > PAIR_LIMIT:
        raise FormatError(f"{path}: has {count} pairs of directions, more than {PAIR_LIMIT}")
    values = np.array([[cell_number(path, *row, name) for name in names] for row in rows])
    lines = [f"line {line}" for line, _ in rows]
    halves = (values, values) if names is _EACH else np.split(values, 2, axis=1)
    wi, wo = (
        check_directions(_unit(half), f"{path}: {what}", lines)
        for half, what in zip(halves, ("lights", "views"), strict=True)
    )
    check_distinct(wi, wo, lines, str(path))
    return wi, wo


def _cells(path: PathLike, number: int, line: str, separator: str) -> list[str]:
    try:
        (cells,) = csv.reader([line.strip("\r\n")], delimiter=separator, strict=True)
    except (csv.Error, ValueError) as error:
        raise FormatError(f"{path}: line {number}: quotes do not match") from error
    return [cell.strip() for cell in cells]


def _check_columns(path: PathLike, columns: list[str], images: bool) -> None:
    """Refuse other columns than one of the sets, with or without those of photographs."""
    form: tuple[str, ...] = _VECTORS if set(_VECTORS) & set(columns) else _ANGLES
    if not images and set(_EACH) & set(columns):
        form = _EACH
    unknown = [name for name in columns if name not in ("file", "quantity", "scale", *form)]
    if unknown:
        known = ", ".join(("file", *form, "quantity", "scale") if images else form)
        raise FormatError(f"{path}: column {unknown[0][:40]!r} is not one of {known}")
    check_columns(path, columns, (*(("file",) if images else ()), *form))


def cell_number(path: PathLike, line: int, row: dict[str, str], name: str) -> float:
    """The number in a column of a line; a :class:`FormatError` says that there is none."""
    where, cell = f"{path}: line {line}: column {name}", row[name][:40]
    try:
        value = parse_number(row[name])
    except ValueError:
        raise FormatError(f"{where}: {cell!r} is not a finite number") from None
    if name.startswith("theta") and not 0.0 <= value < 90.0:
        raise FormatError(f"{where}: {cell} is not from 0 to below 90 degrees")
    return value


def _unit(half: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Vectors from angles in degrees, or vectors of nearly unit length made exactly so."""
    if half.shape[1] == 2:
        return from_degrees(*half.T)
    with np.errstate(over="ignore"):
        lengths = np.sqrt((half**2).sum(axis=1, keepdims=True))
    return np.where(np.abs(lengths - 1.0) <= _LOOSE, half / np.maximum(lengths, 0.5), half)
