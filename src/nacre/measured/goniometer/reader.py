"""The reader of tables of goniometers.

A line names the columns; further lines are samples, with the angles of light and viewer from the
normal and their azimuths, and one value, one a band, or one line a band. Without azimuths, angles
are in the plane of incidence and have a sign. What names do not tell is guessed where the numbers
tell it, and said in a note; what they leave open is asked for.
"""

from __future__ import annotations

import json
import math
from array import array
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FormatError
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike, read_bytes
from nacre.io.format import Format
from nacre.measured.deduplication import from_measurement
from nacre.measured.goniometer.columns import Columns, understood
from nacre.measured.goniometer.rows import Rows, number, read_rows
from nacre.measured.scattered import ScatteredBrdf

_LARGEST = float(np.finfo(np.float32).max)
_SIDECAR = ".columns.json"
_SIDECAR_LIMIT = 1 << 16
_PARTS = b"[Content_Types].xml", b"docProps/", b"xl/"  # of a spreadsheet, which may come first
_STEEPEST = 89.0  # degrees; values with a cosine are not divided by that of a steeper view
QUANTITIES = {
    "brdf": "f_r in 1/sr",
    "brf": "reflectance factors, which are pi f_r",
    "brdf-cos": "f_r times the cosine of the view",
    "percent": "reflectance factors in percent",
}
_WORDS = (  # what a text says values are, the first that it has
    ("percent", ("%", "percent")),
    ("brf", ("brf", "reflectance factor", "radiance factor", "hdrf", "reflectance_factor")),
    ("brdf-cos", ("brdf*cos", "brdf cos", "cos-corrected", "cosine-corrected", "brdf_cos")),
    ("brdf", ("brdf", "bsdf", "1/sr", "sr-1", "sr^-1", "f_r")),
)

_Array = npt.NDArray[np.float64]


def load(
    path: PathLike,
    columns: Mapping[str, str] | None = None,
    quantity: str | None = None,
    sheet: str | None = None,
) -> ScatteredBrdf:
    """Read a table of a goniometer, as text (``.txt``, ``.csv``, ``.tsv``) or ``.xlsx``.

    Parameters
    ----------
    columns
        What columns hold, by their names or numbers: `{"theta_i": "inc", "f": "brdf"}`, with bands
        as wavelengths in nm. Others are found by their names. A file NAME.columns.json beside the
        table may say the same, as {"columns": {...}, "quantity": "brf"}.
    quantity
        What values are, one of :data:`QUANTITIES`.
    sheet
        Sheet of a spreadsheet; the first where None.

    Raises
    ------
    FormatError
        If the file cannot be read or holds no table, a column or what values are is not known, or
        a cell is no number; with what to say.
    """
    noted = _sidecar(path)
    columns, quantity = columns or noted.get("columns"), quantity or noted.get("quantity")
    if quantity not in (None, *QUANTITIES):
        raise FormatError(f"{path}: quantity: {quantity!r} is none of {', '.join(QUANTITIES)}")
    rows = read_rows(path, sheet)
    try:
        found = understood(rows.names, columns)
    except ValueError as error:
        raise FormatError(f"{path}: {error}") from error
    table = _numbers(path, rows, found)
    notes = [f"Columns are read as {found.text(rows.names)}."]
    polar, azimuth, between = _angles(path, table, found)
    values, wavelengths, keep = _values(path, table, found, polar, azimuth)
    polar, azimuth = polar[:, keep], azimuth[:, keep]
    if between:
        azimuth, note = _sides(polar, azimuth, values, signed="phi" not in found.places)
        notes.append(note)
    quantity, guessed = _quantity(path, rows, found, values, quantity)
    notes.append(f"Values are {QUANTITIES[quantity]}{guessed}.")
    if columns is None or guessed:
        notes.append("--columns and --quantity say otherwise.")
    f_r = _as_f_r(values, polar[1], quantity)
    sigma = table[keep, found.places["sigma"]] if "sigma" in found.places else None
    if sigma is not None and sigma.min() < 0.0:
        raise FormatError(f"{path}: column {rows.names[found.places['sigma']]}: is negative")
    wi, wo = (join(w).astype(np.float64) for w in map(from_spherical, polar, azimuth))
    tilted = np.abs(polar[0]) > 1e-6
    azimuths = np.unique(np.round(np.degrees(azimuth[0][tilted]) % 360.0, 3))
    isotropic = between or len(azimuths) <= 1
    facts: dict[str, Any] = {"columns": found.text(rows.names), "quantity": quantity}
    if found.unused:
        facts["columns not used"] = ", ".join(found.unused)[:300]
    if rows.remarks:
        facts["remarks"] = "; ".join(filter(None, rows.remarks))[:1000]
    colored = wavelengths is None
    return from_measurement(
        wi,
        wo,
        (f_r if f_r.shape[1] == 3 else np.repeat(f_r, 3, axis=1)) if colored else None,
        Path(path).stem,
        where=f"{path}: samples",
        isotropic=isotropic,
        spectra=None if colored else f_r,
        wavelengths=wavelengths,
        sigma=None if sigma is None else _as_f_r(sigma[:, None], polar[1], quantity)[:, 0],
        facts=facts,
        notes=[" ".join(notes)],
    )


def _sidecar(path: PathLike) -> dict[str, Any]:
    """What a file beside the table says about it."""
    beside = Path(path).with_name(f"{Path(path).name}{_SIDECAR}")
    if not beside.is_file():
        return {}
    try:
        content = json.loads(read_bytes(beside, _SIDECAR_LIMIT))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{beside}: is not JSON: {str(error)[:80]}") from error
    columns = content.get("columns") if isinstance(content, dict) else None
    texts = isinstance(columns, dict) and all(isinstance(v, str) for v in columns.values())
    if not isinstance(content, dict) or not (columns is None or texts):
        expected = '{"columns": {"theta_i": "NAME"}, "quantity": "brdf"}'
        raise FormatError(f"{beside}: expected {expected}")
    return content


def _numbers(path: PathLike, rows: Rows, found: Columns) -> _Array:
    """The numbers of all rows, shape (n, columns); NaN in cells that are not needed."""
    needed = sorted({*found.places.values(), *found.bands.values()})
    values, width, count = array("d"), len(rows.names), 0
    for line, cells in rows.cells:
        if not any(cells):
            continue
        if len(cells) < len(rows.names) and all(place < len(cells) for place in needed):
            cells = cells + [""] * (width - len(cells))
        if len(cells) != width:
            raise FormatError(f"{path}: line {line}: {len(cells)} cells, expected {width}")
        row = [math.nan] * width
        for place in needed:
            try:
                row[place] = number(cells[place], rows.decimal_comma)
            except ValueError:
                where = f"{path}: line {line}: column {rows.names[place][:40]}"
                raise FormatError(f"{where}: {cells[place][:40]!r} is not a number") from None
            if not abs(row[place]) <= _LARGEST:
                where = f"{path}: line {line}: column {rows.names[place][:40]}"
                raise FormatError(f"{where}: {row[place]:g} is too large")
        values.extend(row)
        count += 1
    if not count:
        raise FormatError(f"{path}: holds no samples")
    return np.frombuffer(values, np.float64).reshape(count, width)


def _angles(path: PathLike, table: _Array, found: Columns) -> tuple[_Array, _Array, bool]:
    """Polar angles and azimuths of light and viewer in radians, shapes (2, n), and whether only the
    azimuth between them is known, or their side in the plane of incidence.
    """
    zero = np.zeros(len(table))
    given = {
        role: table[:, place]
        for role, place in found.places.items()
        if "_" in role or role == "phi"
    }
    angles = {role: value for role, value in given.items() if role.startswith(("theta", "phi"))}
    largest = max(float(np.abs(value).max()) for value in angles.values())
    radians = {role: found.radians.get(role, largest <= 2.0 * math.pi + 0.01) for role in angles}
    angles = {r: v if radians[r] else np.radians(v) for r, v in angles.items()}
    polar = np.stack([angles["theta_i"], angles["theta_o"]])
    if np.abs(polar).max() > math.pi * (1.0 + 1e-6):
        raise FormatError(f"{path}: polar angles: must lie from -180 to 180 degrees")
    absolute = "phi_o" in angles
    if absolute:
        return polar, np.stack([angles.get("phi_i", zero), angles["phi_o"]]), False
    between = angles.get("phi", np.full(len(table), math.pi))
    return polar, np.stack([angles.get("phi_i", zero), angles.get("phi_i", zero) + between]), True


def _values(
    path: PathLike, table: _Array, found: Columns, polar: _Array, azimuth: _Array
) -> tuple[_Array, _Array | None, npt.NDArray[np.int64]]:
    """Values, shape (n, channels), wavelengths in nm where there are any, and the rows they are
    from: where each line is one band, the first of each pair of directions.
    """
    rows = np.arange(len(table))
    if found.bands:
        bands = sorted(found.bands)
        return table[:, [found.bands[band] for band in bands]], np.array(bands), rows
    if "f" not in found.places:
        return table[:, [found.places[channel] for channel in "rgb"]], None, rows
    values = table[:, found.places["f"]]
    if "wavelength" not in found.places:
        return values[:, None], None, rows
    wavelengths = table[:, found.places["wavelength"]]
    if wavelengths.max() < 30.0:  # in micrometers
        wavelengths = np.round(1000.0 * wavelengths, 6)
    if wavelengths.min() <= 0.0:
        raise FormatError(f"{path}: wavelengths: must be positive")
    bands_, band = np.unique(wavelengths, return_inverse=True)
    keys = np.round(np.concatenate([polar, azimuth]).T * 1e6).astype(np.int64)
    _, first, pair = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    spectra = np.full((len(first), len(bands_)), np.nan)
    spectra[pair.reshape(-1), band] = values
    if not np.isfinite(spectra).all():
        lacking = int((~np.isfinite(spectra)).any(axis=1).sum())
        raise FormatError(
            f"{path}: wavelengths: {lacking} of {len(first)} pairs of directions lack some of the "
            f"{len(bands_)} bands; leave these out"
        )
    order = np.argsort(first)
    return spectra[order], bands_, first[order]


def _sides(polar: _Array, azimuth: _Array, values: _Array, *, signed: bool) -> tuple[_Array, str]:
    """Azimuths, and which of the two directions in the plane of incidence is the mirror's: the one
    that is brighter there, or by convention positive angles or an azimuth of 180 degrees.
    """
    mean = np.maximum(values, 0.0).mean(axis=1)
    turned = np.stack([azimuth[0], azimuth[1] + math.pi])
    tilted = np.abs(polar[0]) > math.radians(5.0)
    levels = []
    for phi in (azimuth, turned):
        light = np.stack(from_spherical(polar[0], phi[0]))
        view = np.stack(from_spherical(polar[1], phi[1]))
        mirror = np.clip((light * view * [[-1.0], [-1.0], [1.0]]).sum(axis=0), -1.0, 1.0)
        near = tilted & (np.arccos(mirror) < math.radians(7.5))
        levels.append(float(mean[near].mean()) if near.any() else math.nan)
    if levels[1] > 1.2 * levels[0]:
        which = "negative angles" if signed else "an azimuth of 0"
        return turned, f"The mirror direction has {which}, where values are larger."
    which = "positive angles" if signed else "an azimuth of 180 degrees"
    return azimuth, f"The mirror direction has {which}."


def _quantity(
    path: PathLike, rows: Rows, found: Columns, values: _Array, said: str | None
) -> tuple[str, str]:
    """What values are, and how that is known, as the end of a sentence."""
    if said is not None:
        return said, ""
    names = [rows.names[place] for place in (*found.places.values(), *found.bands.values())]
    for text, source in ((" ".join(names), "columns"), ("; ".join(rows.remarks), "first lines")):
        for quantity, words in _WORDS:
            if any(word in text.lower() for word in words):
                return quantity, f", as the {source} say"
    # A surface cannot reflect more light than it gets: then values are not f_r.
    level = math.pi * float(np.median(np.maximum(values, 0.0)))
    if level > 60.0:
        return "percent", f": as f_r they would reflect {level:.3g} times the light"
    if level > 1.3:
        return "brf", f": as f_r they would reflect {level:.3g} times the light"
    choices = "; ".join(f"--quantity {key}: {text}" for key, text in QUANTITIES.items())
    raise FormatError(
        f"{path}: nothing says what the values in {found.text(rows.names)} are; add one of "
        f"{choices}"
    )


def _as_f_r(values: _Array, theta_o: _Array, quantity: str) -> _Array:
    """f_r in 1/sr; negative values, which are not measured, stay negative."""
    if quantity == "brdf":
        return values
    if quantity == "brdf-cos":
        least = math.cos(math.radians(_STEEPEST))
        return np.asarray(values / np.maximum(np.abs(np.cos(theta_o)), least)[:, None])
    return np.asarray(values / (math.pi if quantity == "brf" else 100.0 * math.pi))


def _recognize(head: bytes) -> bool:
    """Spreadsheets; text has no mark."""
    return head.startswith(b"PK\x03\x04") and any(name in head for name in _PARTS)


def _claims(path: Path) -> bool:
    """Whether columns of a file are known by their names, so that it is no other list or text."""
    try:
        understood(read_rows(path, None).names, _sidecar(path).get("columns"))
    except (FormatError, ValueError):
        return False
    return True


FORMAT = Format(
    "table of a goniometer",
    (".txt", ".csv", ".tsv", ".dat", ".xlsx"),
    _recognize,
    load,
    claims=_claims,
)
