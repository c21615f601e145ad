"""Textures as rectified photographs and a list of their directions, as laboratories have them.

The list is UTF-8 text with comma-separated values (or semicolons or tabs). Its first line names
the columns, in any order: `file`, a path from the folder of the list; the unit vectors to light and
view as lx, ly, lz, vx, vy, vz, or their angles in degrees as theta_l, phi_l, theta_v, phi_v; and,
if wanted, `quantity`, what the pixels of the image hold: `reflectance` or `radiance` (see
:data:`nacre.btf.image_folder.Quantity`). Lines that start with # do not matter.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf.directions import PAIR_LIMIT, check_directions, check_distinct, from_degrees
from nacre.btf.image_folder import QUANTITIES, ImageFolderBtf, Quantity
from nacre.files import Format, FormatError, PathLike
from nacre.text_file import parse_number, read_lines

LIST = "directions.csv"
"""Name of the list within a folder of photographs."""

_SIZE_LIMIT = 1 << 26
_VECTORS = ("lx", "ly", "lz", "vx", "vy", "vz")
_ANGLES = ("theta_l", "phi_l", "theta_v", "phi_v")
_LOOSE = 0.02
"""How far a vector's length may be from 1: few decimals are given at times."""

_Lines = Iterable[tuple[int, str]]
_Rows = list[tuple[int, dict[str, str]]]


def load_photographs(
    folder: PathLike, directions: PathLike | None = None, quantity: Quantity | None = None
) -> ImageFolderBtf:
    """Read a folder of photographs.

    Parameters
    ----------
    folder
        Where the images are (OpenEXR, PNG or JPEG, see :class:`ImageFolderBtf`); its name becomes
        the material's.
    directions
        The list; :data:`LIST` in the folder where None.
    quantity
        What pixels hold, where the list does not say; "reflectance" where None.

    Raises
    ------
    FormatError
        If the list cannot be read, a column is missing, unknown or there twice, a value is not a
        finite number, a direction is not of unit length or lies below the horizon, a pair of them
        appears twice, both the list and `quantity` say what pixels hold, or an image is bad.
    """
    folder = Path(folder)
    path = Path(directions) if directions is not None else folder / LIST
    lines = read_lines(path, _SIZE_LIMIT)
    rows = _read_rows(path, lines, ("file",))
    if "quantity" in rows[0][1] and quantity is not None:
        raise FormatError(f"{path}: column quantity says what pixels hold; do not state it again")
    wi, wo = _pairs(path, rows)
    return ImageFolderBtf(
        [_image(path, folder, line, row["file"]) for line, row in rows],
        wi,
        wo,
        folder.resolve().name,
        [
            _quantity(path, line, row.get("quantity", quantity or QUANTITIES[0]))
            for line, row in rows
        ],
    )


def read_pairs(path: PathLike) -> tuple[Floats, Floats]:
    """Pairs of directions of a list, with or without names of images; `wi`, `wo`, shape (n, 3).

    Raises
    ------
    FormatError
        As of :func:`load_photographs`.
    """
    path = Path(path)
    return _pairs(path, _read_rows(path, read_lines(path, _SIZE_LIMIT), ()))


def _pairs(path: Path, rows: _Rows) -> tuple[Floats, Floats]:
    """Directions of all rows, checked."""
    names = _VECTORS if "lx" in rows[0][1] else _ANGLES
    values = np.array([[_number(path, line, row, name) for name in names] for line, row in rows])
    places = [f"line {line}" for line, _ in rows]
    wi, wo = (
        check_directions(_unit(half), f"{path}: {what}")
        for half, what in zip(np.split(values, 2, axis=1), ("lights", "views"), strict=True)
    )
    check_distinct(wi, wo, places, str(path))
    return wi, wo


def _read_rows(path: Path, lines: _Lines, needed: tuple[str, ...]) -> _Rows:
    """Number and cells by column of each line after that which names the columns."""
    columns: list[str] = []
    rows: _Rows = []
    separator = ","
    for number, line in lines:
        if not line.strip() or line.startswith("#"):
            continue
        if not columns:
            separator = next((mark for mark in ";\t" if mark in line), ",")
            columns = [cell.lower() for cell in _cells(path, number, line, separator)]
            _check_columns(path, columns, needed)
            continue
        cells = _cells(path, number, line, separator)
        if len(cells) != len(columns):
            raise FormatError(f"{path}: line {number}: {len(cells)} values, not {len(columns)}")
        if len(rows) == PAIR_LIMIT:
            raise FormatError(f"{path}: lists more than {PAIR_LIMIT} images")
        rows.append((number, dict(zip(columns, cells, strict=True))))
    if not rows:
        raise FormatError(f"{path}: lists {'no images' if needed else 'no directions'}")
    return rows


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    try:
        (cells,) = csv.reader([line.strip("\r\n")], delimiter=separator, strict=True)
    except (csv.Error, ValueError) as error:
        raise FormatError(f"{path}: line {number}: quotes do not match") from error
    return [cell.strip() for cell in cells]


def _check_columns(path: Path, columns: list[str], needed: tuple[str, ...]) -> None:
    """Refuse other columns than one of the two sets, with or without `quantity`."""
    form = _VECTORS if set(_VECTORS) & set(columns) else _ANGLES
    unknown = [name for name in columns if name not in ("file", "quantity", *form)]
    if unknown:
        known = ", ".join(("file", *form, "quantity"))
        raise FormatError(f"{path}: column {unknown[0][:40]!r} is not one of {known}")
    missing = [name for name in (*needed, *form) if name not in columns]
    if missing:
        raise FormatError(f"{path}: columns: {', '.join(missing)} missing")
    if len(set(columns)) < len(columns):
        twice = next(name for name in columns if columns.count(name) > 1)
        raise FormatError(f"{path}: columns: {twice!r} appears twice")


def _number(path: Path, line: int, row: dict[str, str], name: str) -> float:
    try:
        return parse_number(row[name])
    except ValueError:
        raise FormatError(
            f"{path}: line {line}: column {name}: {row[name][:40]!r} is not a finite number"
        ) from None


def _unit(half: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Vectors of angles in degrees, or vectors of nearly unit length made exactly so."""
    if half.shape[1] == 2:
        return from_degrees(*half.T)
    with np.errstate(over="ignore"):
        lengths = np.sqrt((half**2).sum(axis=1, keepdims=True))
    return np.where(np.abs(lengths - 1.0) <= _LOOSE, half / np.maximum(lengths, 0.5), half)


def _image(path: Path, folder: Path, line: int, name: str) -> Path:
    """Path of an image that is there; it must not leave the folder."""
    relative = PurePosixPath(name.replace("\\", "/"))
    if not name or "\0" in name or relative.is_absolute() or ".." in relative.parts:
        raise FormatError(f"{path}: line {line}: file {name[:80]!r} is no path within the folder")
    if not (folder / relative).is_file():
        raise FormatError(f"{path}: line {line}: file {name[:80]!r} is not in {folder}")
    return folder / relative


def _quantity(path: Path, line: int, cell: str) -> Quantity:
    for quantity in QUANTITIES:
        if cell == quantity:
            return quantity
    raise FormatError(
        f"{path}: line {line}: quantity {cell[:40]!r}, expected {' or '.join(QUANTITIES)}"
    )


def _load(path: PathLike, quantity: Quantity | None = None) -> ImageFolderBtf:
    """A folder with a list, or the list, beside which the images are."""
    path = Path(path)
    if path.is_dir():
        return load_photographs(path, quantity=quantity)
    return load_photographs(path.parent, path, quantity)


FORMAT = Format("photographs", (".csv",), None, _load, claims=lambda path: (path / LIST).is_file())
"""Entry of the registry of formats of textures."""
