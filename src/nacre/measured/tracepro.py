"""Surface properties of TracePro as text.

A header, a table of coefficients for each temperature, wavelength and direction of the light, and,
for scatter by a table, rows of values. Both say f_r by the distance of the viewer from the mirror
direction, as seen from above (the difference of direction cosines); rows also by the azimuth of
that difference. The layout is that of files which TracePro 7 and 19 exported; azimuth 0 is taken
for "away from the light", which these files do not tell.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.errors import CUT_SHORT, FormatError, in_words
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike, first_bytes
from nacre.io.format import Format
from nacre.io.text_file import parse_numbers, read_lines
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.specular_nodes import Resolution

_SIZE_LIMIT = 1 << 28
_TITLE = "tracepro surface property data"
_TABLE = "table_bsdf_data"
_LARGEST = float(np.finfo(np.float32).max)
_LIGHT = ("temperature", "wavelength", "incangle", "aziangle")
_ROWS = (*_LIGHT, "scatterbeta", "brdf")
_ABG = (*_LIGHT, "brdf_a", "brdf_b", "brdf_g")


@dataclass(eq=False)
class _Table:
    """Columns of one table, each shape (n,)."""

    names: list[str] = field(default_factory=list)
    rows: Floats = field(default_factory=lambda: np.empty((0, 0)))

    def __getitem__(self, name: str) -> Floats:
        return np.asarray(self.rows[:, self.names.index(name)])

    def largest(self, name: str) -> float:
        """Of a column, by size; 0 where there is none."""
        return float(np.abs(self[name]).max(initial=0.0)) if name in self.names else 0.0


def load(path: PathLike) -> ScatteredBrdf:
    """Read the reflection of a surface property in a ``.txt`` file: its table, or its ABg model.

    Several wavelengths become bands. Of several temperatures, the first is read, and a note says
    so; notes also name a mirror image and transmission. A FormatError says that the file cannot be
    read, which line is wrong, or that it holds no scattered reflection.
    """
    header, optical, table = _read(path)
    used = table if len(table.rows) and table.largest("brdf") > 0.0 else None
    if used is None and optical.largest("brdf_a") == 0.0:
        raise FormatError(
            f"{path}: holds no scattered reflection: neither a table with a BRDF above 0 nor "
            "ABg coefficients with an A above 0"
        )
    source = optical if used is None else used
    temperatures = source["temperature"]
    kept = temperatures == temperatures[0]
    notes = list(_notes(optical, table, temperatures))
    chosen = _Table(source.names, source.rows[kept])
    bands = np.unique(chosen["wavelength"])
    samples = [
        (_from_rows if used is not None else _from_abg)(
            _Table(chosen.names, chosen.rows[chosen["wavelength"] == band])
        )
        for band in bands
    ]
    wi, wo, _values = samples[0]
    for band, (other_wi, other_wo, _) in zip(bands, samples, strict=True):
        if not (np.array_equal(wi, other_wi) and np.array_equal(wo, other_wo)):
            raise FormatError(
                f"{path}: wavelength {band:g}: has other directions than {bands[0]:g}"
            )
    spectra = np.stack([f for _, _, f in samples], axis=1)
    if not (np.abs(spectra) <= _LARGEST).all():
        raise FormatError(f"{path}: a value is too large")
    turns = chosen["aziangle"][chosen["incangle"] > 0.0]
    return from_measurement(
        wi,
        wo,
        None,
        header.get("name", "") or Path(path).stem,
        where=f"{path}: values",
        isotropic=len(np.unique(turns % 360.0)) <= 1,
        spectra=spectra,
        wavelengths=1e3 * bands,
        notes=notes,
    )


def _notes(optical: _Table, table: _Table, temperatures: Floats) -> Iterator[str]:
    if table.largest("btdf") > 0.0 or optical.largest("btdf_a") > 0.0:
        yield "The file also holds transmission, which is left out."
    if mirrored := max(optical.largest("refl_s"), optical.largest("refl_p")):
        yield f"A mirror image of up to {mirrored:.3g} of the light is left out: it has no f_r."
    if len(others := np.unique(temperatures)) > 1:
        kept = f"{temperatures[0]:g} K is read"
        yield f"The file holds {len(others)} temperatures, of which {kept}."


def _from_rows(table: _Table) -> tuple[Floats, Floats, Floats]:
    """Directions to the light and the viewer (n, 3), and f_r (n,), of one wavelength.

    A table without azimuths is symmetric about the mirror direction.
    """
    columns = table.rows
    if "scatterazimuth" not in table.names:
        turns = np.arange(0.0, 360.0, 15.0)
        columns = np.repeat(columns, len(turns), axis=0)
        turn = np.tile(turns, len(table.rows))
    else:
        turn = table["scatterazimuth"]
    whole = _Table(table.names, columns)
    wi, wo = _directions(whole["incangle"], whole["aziangle"], whole["scatterbeta"], turn)
    seen = wo[:, 2] > 0.0
    return wi[seen], wo[seen], whole["brdf"][seen]


def _from_abg(table: _Table) -> tuple[Floats, Floats, Floats]:
    """The model A / (B + distance^g) of one wavelength, at nodes dense about the mirror direction;
    B and g of the y axis, where they are given, hold across the plane of the light.
    """
    elliptic = {"brdf_by", "brdf_gy"} <= {*table.names}
    order = np.argsort(table["incangle"], kind="stable")
    angles, first = np.unique(table["incangle"][order], return_index=True)
    names = ("brdf_a", "brdf_b", "brdf_g", *(("brdf_by", "brdf_gy") if elliptic else ()))
    coefficients = {name: table[name][order][first] for name in names}
    lights = Resolution().lights() if len(angles) == 1 else angles
    found: list[tuple[Floats, Floats, Floats]] = []
    distances = 2.0 * np.linspace(0.0, 1.0, 60) ** 3
    distance, turn = (a.reshape(-1) for a in np.meshgrid(distances, np.arange(0.0, 360.0, 15.0)))
    for light in lights:
        a, b, g, *across = (np.interp(light, angles, coefficients[name]) for name in names)
        if elliptic and across[0] > 0.0:
            share = np.sin(np.radians(turn)) ** 2
            b, g = b + (across[0] - b) * share, g + (across[1] - g) * share
        wi, wo = _directions(np.full_like(turn, light), np.zeros_like(turn), distance, turn)
        seen = wo[:, 2] > 0.0
        with np.errstate(divide="ignore", over="ignore"):
            f = a / (b + distance**g)
        found.append((wi[seen], wo[seen], np.broadcast_to(f, turn.shape)[seen]))
    wi, wo, values = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return wi, wo, values


def _directions(
    incidence: Floats, plane: Floats, distance: Floats, turn: Floats
) -> tuple[Floats, Floats]:
    """Unit vectors (n, 3) from angles in degrees; views beyond the horizon have z = 0."""
    wi = join(from_spherical(np.radians(incidence), np.radians(plane)))
    away = np.radians(plane + 180.0 + turn)
    xy = -wi[:, :2] + distance[:, None] * np.stack([np.cos(away), np.sin(away)], axis=1)
    z = np.sqrt(np.maximum(1.0 - (xy**2).sum(axis=1), 0.0))
    return wi, np.concatenate([xy, z[:, None]], axis=1)


def _read(path: PathLike) -> tuple[dict[str, str], _Table, _Table]:
    """The header, the table of coefficients, and that of values."""
    header: dict[str, str] = {}
    tables: dict[tuple[str, ...], _Table] = {}
    names: list[str] = []
    numbers = array("d")

    def end() -> None:
        if names:
            rows = np.frombuffer(numbers, np.float64).reshape(-1, len(names)).copy()
            tables[_ROWS if "scatterbeta" in names else _ABG] = _Table(list(names), rows)

    for number, line in read_lines(path, _SIZE_LIMIT):
        words = line.split()
        lower = [word.lower() for word in words]
        if not words or lower == [_TABLE]:
            continue
        if lower[0] == "save-data":
            break
        if lower[0] == "temperature":
            end()
            names, numbers = lower, array("d")
            wanted = _ROWS if "scatterbeta" in names else _ABG
            if missing := [name for name in wanted if name not in names]:
                raise FormatError(f"{path}: line {number}: has no column {in_words(missing)}")
        elif not names:
            header.setdefault(lower[0], " ".join(words[1:]))
        else:
            values = parse_numbers(words, f"{path}: line {number}")
            if len(values) != len(names):
                counted = f"{len(values)} numbers, expected {len(names)}"
                raise FormatError(f"{path}: line {number}: {counted}")
            numbers.extend(values)
    end()
    if not any(len(table.rows) for table in tables.values()):
        raise FormatError(f"{path}: ends before a table of values; {CUT_SHORT}")
    for table in tables.values():
        _check(path, table)
    return header, tables.get(_ABG, _Table()), tables.get(_ROWS, _Table())


def _check(path: PathLike, table: _Table) -> None:
    if not len(table.rows):
        return
    if (table["incangle"] < 0.0).any() or (table["incangle"] >= 90.0).any():
        raise FormatError(f"{path}: IncAngle: must lie from 0 to below 90 degrees")
    if (table["wavelength"] <= 0.0).any():
        raise FormatError(f"{path}: Wavelength: must be above 0 (in micrometers)")
    if "scatterbeta" in table.names and (table["scatterbeta"] < 0.0).any():
        raise FormatError(f"{path}: ScatterBeta: must not be below 0")


def _recognize(head: bytes) -> bool:
    return head.lstrip().lower().startswith(_TITLE.encode())


FORMAT = Format(
    "TracePro surface property",
    (".txt",),
    _recognize,
    load,
    claims=lambda path: _recognize(first_bytes(path)),  # any text ends in .txt
)
