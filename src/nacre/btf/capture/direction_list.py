"""Directions to capture at: those of a dome, or of a list in a file."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.btf.domes import BONN, UTIA, pairs
from nacre.files import FormatError, read_bytes
from nacre.geometry import from_spherical, join

_DOMES = {"bonn": BONN, "utia": UTIA}
_EACH = ("theta", "phi")
_PAIRS = ("theta_l", "phi_l", "theta_v", "phi_v")
_SIZE_LIMIT = 1 << 24
_PAIR_LIMIT = 1 << 18
_STEEPEST = 89.0


def read_directions(source: str) -> tuple[Floats, Floats]:
    """Directions to the light and to the viewer, shape (n, 3) each.

    Parameters
    ----------
    source
        `bonn`, `utia`, or a CSV file of degrees. Its first line names the columns: `theta,phi` for
        directions that each serve as light and as view, or `theta_l,phi_l,theta_v,phi_v` for pairs.

    Raises
    ------
    FormatError
        If the file is no such list, naming the line; if an angle from the normal is above 89
        degrees; or if there are more than 262,144 pairs.
    """
    if source in _DOMES:
        return _DOMES[source].pairs()
    path = Path(source)
    if not path.suffix and not path.exists():
        raise FormatError(f"{source}: is neither a dome ({', '.join(_DOMES)}) nor a CSV file")
    try:
        rows = list(csv.reader(read_bytes(path, _SIZE_LIMIT).decode("utf-8-sig").splitlines()))
    except (UnicodeDecodeError, csv.Error) as error:
        raise FormatError(f"{path}: is no CSV file: {error}") from error
    columns = tuple(cell.strip() for cell in rows[0]) if rows else ()
    if columns not in (_EACH, _PAIRS):
        known = " or ".join(",".join(names) for names in (_EACH, _PAIRS))
        raise FormatError(f"{path}: line 1: expected the columns {known}")
    angles = [_angles(path, line, row, columns) for line, row in enumerate(rows[1:], 2) if row]
    count = len(angles) if columns == _PAIRS else len(angles) ** 2
    if not 1 <= count <= _PAIR_LIMIT:
        raise FormatError(f"{path}: has {count} pairs of directions, not 1 to {_PAIR_LIMIT}")
    theta, phi = np.moveaxis(np.radians(angles).reshape(len(angles), -1, 2), -1, 0)
    vectors = join(from_spherical(theta, phi)).astype(np.float32)
    if columns == _EACH:
        return pairs(vectors[:, 0], vectors[:, 0])
    return vectors[:, 0], vectors[:, 1]


def _angles(path: Path, line: int, row: list[str], columns: tuple[str, ...]) -> list[float]:
    if len(row) != len(columns):
        raise FormatError(f"{path}: line {line}: {len(row)} values, not {len(columns)}")
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        values = [math.nan]
    if not all(math.isfinite(v) for v in values):
        raise FormatError(f"{path}: line {line}: expected finite numbers")
    if not all(0.0 <= theta <= _STEEPEST for theta in values[::2]):
        raise FormatError(f"{path}: line {line}: theta must be from 0 to {_STEEPEST:g} degrees")
    return values
