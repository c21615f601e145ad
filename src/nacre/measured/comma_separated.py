"""Scattered samples of reflectance as comma-separated values.

UTF-8 text. Header lines come first: `# key: value`, or `key: value` and `key = value` without the
mark, as in the headers of ASTM E1392. Then one line names the columns, in any order, and every
further line is one sample. Columns are the angles theta_i, phi_i (light) and theta_o, phi_o
(viewer), and f_r in 1/sr: r, g, b (linear Rec. 709), or f alone (grey), or one column a band, named
by its wavelength in nm. docs/formats.md has the grammar.
"""

from __future__ import annotations

import csv
import io
import math
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.files import Format, FormatError, PathLike, atomic_path, read_bytes
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.measured.scattered import ScatteredBrdf, from_measurement
from nacre.measured.spectra import to_rgb

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
"""Columns of the directions to the light and to the viewer."""

_SIZE_LIMIT = 1 << 28
_LARGEST = float(np.finfo(np.float32).max)
_COLUMN_LIMIT = 1024
_UNITS = {
    "deg": math.pi / 180.0,
    "degree": math.pi / 180.0,
    "degrees": math.pi / 180.0,
    "rad": 1.0,
    "radian": 1.0,
    "radians": 1.0,
}
_ALIASES = {
    "theta_s": "theta_o",
    "phi_s": "phi_o",
    "theta_r": "theta_o",
    "phi_r": "phi_o",
    "brdf": "f",
    "bsdf": "f",
    "f_r": "f",
    "red": "r",
    "green": "g",
    "blue": "b",
}
_USED = ("units", "values")
_COLUMN = re.compile(r"(?P<name>[^\[\]()]*?)\s*(?:[\[(]\s*(?P<unit>[^\[\]()]*?)\s*[\])])?")
_BAND = re.compile(r"(\d+(?:\.\d+)?)\s*(?:nm)?")
_PAIR = re.compile(r"#?\s*(?P<key>[^:=,#]+?)\s*[:=]\s*(?P<value>.*?)\s*")

_Array = npt.NDArray[np.float64]


def load(path: PathLike) -> ScatteredBrdf:
    """Read a ``.csv`` file of scattered samples.

    Parameters
    ----------
    path
        File to read.

    Raises
    ------
    FormatError
        If the file cannot be read, a column or the unit of the angles is missing, or a value is
        not a finite number.
    MissingExtraError
        If the file has bands and colour-science is not installed.
    """
    try:
        text = read_bytes(path, _SIZE_LIMIT).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(
            f"{path}: byte {error.start} is not UTF-8 text; save the file as UTF-8"
        ) from error
    lines = text.splitlines()
    header, start = _header(path, lines)
    columns, scales = _columns(path, lines[start], header)
    table = _table(path, lines, start, columns)
    angles = [table[:, columns.index(name)] * scales[name] for name in ANGLES]
    wi, wo = (join(from_spherical(*angles[k : k + 2])).astype(np.float64) for k in (0, 2))
    if min(angles[0].min(), angles[2].min()) < 0.0 or max(
        angles[0].max(), angles[2].max()
    ) > math.pi * (1.0 + 1e-6):
        raise FormatError(f"{path}: polar angles: must lie from 0 to 180 degrees; check the units")
    values = {name: table[:, k] for k, name in enumerate(columns) if name not in ANGLES}
    bands = sorted((float(name), name) for name in values if name not in {"r", "g", "b", "f"})
    spectra = np.stack([values[name] for _, name in bands], axis=1) if bands else None
    wavelengths = np.array([band for band, _ in bands]) if bands else None
    if spectra is not None and wavelengths is not None:
        rgb = to_rgb(spectra, wavelengths)
    else:
        rgb = np.stack([values[c] if c in values else values["f"] for c in "rgb"], axis=1)
    try:
        return from_measurement(
            wi,
            wo,
            rgb,
            header.pop("name", "") or Path(path).stem,
            isotropic=_flag(path, header, "isotropic"),
            spectra=spectra,
            wavelengths=wavelengths,
            facts={f"header {key}": value for key, value in header.items() if key not in _USED},
        )
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(f"{path}: samples: {error}") from error


def save(brdf: Brdf, path: PathLike) -> None:
    """Write the samples of a :class:`ScatteredBrdf`, whole or not at all.

    Angles are written in degrees; bands where it has them, else linear RGB. What this function
    wrote is written again byte for byte.

    Raises
    ------
    FormatError
        If `brdf` does not hold scattered samples or the path cannot be written.
    """
    if not isinstance(brdf, ScatteredBrdf):
        raise FormatError(f"{path}: holds scattered samples only; {brdf.name or 'this'} has none")
    samples, wavelengths, spectra = brdf.samples, brdf.wavelengths, brdf.spectra
    angles = (*to_spherical(split(samples.wi)), *to_spherical(split(samples.wo)))
    degrees = np.round(np.degrees(np.stack(angles, axis=1)), 7) + 0.0  # no negative zero
    if spectra is None or wavelengths is None:
        names, values = list("rgb"), samples.rgb
    else:
        names, values = [f"{w:.10g} nm" for w in wavelengths], spectra
    text = io.StringIO()
    text.write(f"# name: {' '.join(brdf.name.split())}\n# units: degrees\n")
    text.write(f"# isotropic: {'yes' if brdf.isotropic else 'no'}\n# values: f_r in 1/sr\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*ANGLES, *names])
    for row, value in zip(degrees, values, strict=True):
        writer.writerow([*(f"{x:.10g}" for x in row), *(f"{x:.9g}" for x in value)])
    with atomic_path(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8", newline="")


def _header(path: PathLike, lines: list[str]) -> tuple[dict[str, str], int]:
    """Pairs of keys (lower case) and values, and the index of the line that names the columns."""
    pairs: dict[str, str] = {}
    for number, line in enumerate(lines):
        stripped = line.strip().strip(",")  # spreadsheets pad every line with commas
        if not stripped or "theta_i" not in stripped.lower() or stripped.startswith("#"):
            pair = _PAIR.fullmatch(stripped)
            if pair:
                pairs[pair["key"].lower()] = pair["value"]
            elif stripped and not stripped.startswith(("#", "ASTM")):
                break
            continue
        return pairs, number
    raise FormatError(
        f"{path}: has no line that names columns; expected one like {','.join(ANGLES)},r,g,b"
    )


def _columns(
    path: PathLike, line: str, header: dict[str, str]
) -> tuple[list[str], dict[str, float]]:
    """Names of the columns, bands as numbers, and the factor from each angle to radians."""
    names: list[str] = []
    scales: dict[str, float] = {}
    for cell in line.split(","):
        match = _COLUMN.fullmatch(cell.strip().strip('"').lower())
        name, unit = (match["name"], match["unit"]) if match else (cell.strip(), None)
        name = _ALIASES.get(name, name)
        band = _BAND.fullmatch(name)
        names.append(band[1] if band else name)
        if name in ANGLES:
            scales[name] = _scale(path, name, unit or header.get("units"))
    if len(names) > _COLUMN_LIMIT:
        raise FormatError(f"{path}: {len(names)} columns, at most {_COLUMN_LIMIT} are read")
    missing = [name for name in ANGLES if name not in names]
    if missing:
        raise FormatError(f"{path}: columns: {', '.join(missing)} missing")
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise FormatError(f"{path}: columns: {twice[0][:40]!r} appears twice")
    values = [name for name in names if name not in ANGLES]
    if sorted(values) == ["b", "g", "r"] or values == ["f"]:
        return names, scales
    if not values or not all(_BAND.fullmatch(name) for name in values):
        found = ", ".join(values)[:80] or "none"
        raise FormatError(
            f"{path}: columns: beside the angles there must be r, g, b, or f, or "
            f"wavelengths in nm; found {found}"
        )
    bands = {float(name) for name in values}
    if len(bands) < len(values) or not all(1.0 <= band <= 1e6 for band in bands):
        raise FormatError(f"{path}: columns: wavelengths must differ and be 1 to 1,000,000 nm")
    return names, scales


def _scale(path: PathLike, name: str, unit: str | None) -> float:
    if unit is None:
        raise FormatError(
            f"{path}: column {name}: has no unit; name it '{name} [deg]' or '{name} [rad]', or "
            "add a line '# units: degrees'"
        )
    if unit.strip().lower() not in _UNITS:
        raise FormatError(f"{path}: column {name}: unit {unit[:40]!r}, expected degrees or radians")
    return _UNITS[unit.strip().lower()]


def _table(path: PathLike, lines: list[str], start: int, columns: list[str]) -> _Array:
    """Numbers of the lines after `start`, shape (n, columns)."""
    rows = []
    for number, line in enumerate(lines[start + 1 :], start + 2):
        cells = [cell.strip().strip('"') for cell in line.split(",")]
        if not any(cells) or line.lstrip().startswith("#"):
            continue
        if len(cells) != len(columns):
            raise FormatError(
                f"{path}: line {number}: {len(cells)} values, expected {len(columns)}"
            )
        for name, cell in zip(columns, cells, strict=True):
            if not _is_finite(cell):
                raise FormatError(
                    f"{path}: line {number}: column {name}: {cell[:40]!r} is not a finite number"
                )
        rows.append([float(cell) for cell in cells])
    if not rows:
        raise FormatError(f"{path}: holds no samples")
    return np.array(rows, np.float64)


def _is_finite(cell: str) -> bool:
    try:
        return abs(float(cell)) <= _LARGEST
    except ValueError:
        return False


def _flag(path: PathLike, header: dict[str, str], key: str) -> bool:
    value = header.pop(key, "yes").lower()
    if value not in {"yes", "no"}:
        raise FormatError(f"{path}: header '{key}': {value[:40]!r}, expected yes or no")
    return value == "yes"


def _recognise(head: bytes) -> bool:
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    return b"theta_" in text or (text.startswith((b"#", b"astm")) and b"# cornell" not in text)


FORMAT = Format("comma-separated samples", (".csv",), _recognise, load, save)
"""Entry of the registry of formats."""
