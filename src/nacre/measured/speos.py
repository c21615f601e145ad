"""Ansys Speos' spectral BSDF files as text, the "complete scattering" of a surface.

A header; for each incidence and wavelength the percentage of light that is reflected and a table
over the polar angle and the azimuth of the reflected light, from the mirror direction, in degrees.
Values need only be proportional to f_r: the percentage says how much they are. Tables of
transmission follow. Ansys Speos help, "Structure of BRDF files", and the files that Ansys' pyspeos
and Lumerical write; versions 7 to 9 have one layout.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import CUT_SHORT, FormatError, printable
from nacre.io.files import PathLike, atomic_path, read_bytes
from nacre.io.format import Format
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.specular_nodes import Resolution, bands, directions, reflected, spectra
from nacre.measured.words import Words
from nacre.sampling import check_isotropic

_TITLE = "OPTIS - brdf surface file v9.0"
_SIZE_LIMIT = 1 << 28
_LARGEST = 1e30
_SHORTEST, _LONGEST = 360.0, 830.0  # wavelengths in nm that Speos takes
LEFT_OUT = "The file also holds transmission, which is left out."


def load(path: PathLike, as_stored: bool = False) -> ScatteredBrdf:
    """Read the reflection in a ``.brdf`` text file.

    Tables are scaled to the percentages, unless `as_stored`. A FormatError says that the file
    cannot be read, is in binary mode or holds no reflection, or that a table is cut short or has
    other angles than the first of its incidence.
    """
    words, name = start(path, "brdf surface file", _COMMENT)
    kind = [flag(words, name) for name in ("reflection", "transmission", "kind of values")]
    if not kind[0]:
        raise FormatError(f"{path}: holds transmission or nothing; only reflection is read")
    counts = [words.count(name) for name in ("incidences", "wavelengths")]
    lights = words.numbers(counts[0], "incidence")
    words.check_angles(lights, "incidence", 90.0)
    wavelengths = words.numbers(counts[1], "wavelength")
    if wavelengths[0] <= 0.0 or not (np.diff(wavelengths) > 0.0).all():
        raise FormatError(f"{path}: wavelengths: must be positive and increase")
    wi, wo, values = [], [], []
    for light in lights:
        polars, azimuths, found = _incidence(words, len(wavelengths), not kind[2], as_stored)
        one, many = directions(light, polars, azimuths)
        wi.append(np.broadcast_to(one, many.shape).reshape(-1, 3))
        wo.append(many.reshape(-1, 3))
        values.append(found.reshape(-1, len(wavelengths)))
    if not kind[1]:
        words.end("end", "of", "file")
    return from_measurement(
        np.concatenate(wi).astype(np.float64),
        np.concatenate(wo).astype(np.float64),
        None,
        name or Path(path).stem,
        where=f"{path}: tables",
        spectra=np.concatenate(values),
        wavelengths=wavelengths,
        notes=[LEFT_OUT] if kind[1] else [],
    )


def start(path: PathLike, kind: str, unnamed: str) -> tuple[Words, str]:
    """Words behind the description in a text file of Speos, and the name of the material, which is
    the comment; "" where that is the one which tools write by themselves.

    `kind` is what the first line calls the file. A FormatError says that the file is of another, of
    a version before 7, in binary mode, or no text.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    title = re.split(rb"[\r\n]", data[:200])[0].decode("latin-1").strip()
    match = re.fullmatch(rf"OPTIS - {kind} v(\d+)(?:\.\d+)?", title, re.I)
    if match is None:
        raise FormatError(f"{path}: starts with {title[:60]!r}, expected 'OPTIS - {kind} v9.0'")
    if int(match[1][:3]) < _OLDEST:
        problem = f"version {match[1]} has another layout; those from {_OLDEST} on are read"
        raise FormatError(f"{path}: {problem}: save it anew with Speos' viewer")
    try:
        text = data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError:
        text = data.decode("windows-1252", "replace").replace("\r\n", "\n")
    lines = text[:2000].split("\n", 4)
    if len(lines) < 5 or lines[1].strip() != "0":
        raise FormatError(f"{path}: is in binary mode or cut short; only text is read")
    if not text.endswith("\n") and not text.lower().endswith("end of file"):
        raise FormatError(f"{path}: the last line does not end; {CUT_SHORT}")
    count = lines[3].strip()
    if not (count.isdecimal() and count.isascii()) or len(count) > 9:
        problem = f"{count[:40]!r}, expected how many characters the description has"
        raise FormatError(f"{path}: line 4: {problem}")
    begin = sum(len(line) + 1 for line in lines[:4]) + int(count)
    name = lines[2].strip()
    rest = (match[0] for match in re.compile(r".*(?:\n|\Z)").finditer(text, begin))
    words = Words(path, enumerate(rest, text.count("\n", 0, begin) + 1))
    return words, "" if name in (unnamed, "Comment") else printable(name[:200])


def flag(words: Words, expected: str) -> bool:
    """The next word, which is 0 or 1."""
    value = words.number(expected)
    if value not in (0.0, 1.0):
        raise words.error(f"{expected}: {value:g}, expected 0 or 1")
    return bool(value)


def table(words: Words) -> tuple[Floats, Floats, Floats]:
    """Polar angles (p,) and azimuths (a,) in degrees, and the values of one table, (p, a)."""
    shape = words.count("polar angles"), words.count("azimuths")
    azimuths = words.numbers(shape[1], "azimuths")
    rows = words.numbers(shape[0] * (shape[1] + 1), "a table").reshape(shape[0], -1)
    polars, values = rows[:, 0], rows[:, 1:]
    words.check_angles(azimuths, "azimuths", 360.0)
    words.check_angles(polars, "polar angles", 90.0)
    return polars, azimuths, values


def without_cosine(values: Floats, polars: Floats) -> Floats:
    """f_r from intensities, shape (polars, azimuths), which have the cosine of the view."""
    return values / np.maximum(np.cos(np.radians(polars)), 1e-3)[:, None]


def _incidence(
    words: Words, count: int, intensities: bool, as_stored: bool
) -> tuple[Floats, Floats, Floats]:
    """Polar angles and azimuths in degrees, and f_r of shape (polars, azimuths, wavelengths)."""
    nodes: tuple[Floats, Floats] | None = None
    tables = []
    for _ in range(count):
        percent = words.number("a percentage of reflection")
        if percent < 0.0:
            raise words.error(f"reflection: {percent:g} %, expected 0 or more")
        polars, azimuths, values = table(words)
        if nodes is not None and not all(map(np.array_equal, nodes, (polars, azimuths))):
            raise words.error("has other angles at every wavelength; not read")
        nodes = polars, azimuths
        if intensities:
            values = without_cosine(values, polars)
        tables.append(values if as_stored else _scaled(words, values, percent, polars, azimuths))
    assert nodes is not None
    return *nodes, np.stack(tables, axis=-1)


def _scaled(
    words: Words, values: Floats, percent: float, polars: Floats, azimuths: Floats
) -> Floats:
    """Values that reflect a percentage of the light."""
    total = float(reflected(np.maximum(values, 0.0), polars, azimuths))
    if percent == 0.0:
        return 0.0 * values
    if total < 1e-30 or (factor := 0.01 * percent / total) * np.abs(values).max() > _LARGEST:
        raise words.error(f"a table reflects nothing, so that it cannot reflect {percent:g} %")
    return factor * values


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write a Speos spectral BSDF of an isotropic reflectance as text, whole or not at all.

    Spectra are those of :func:`nacre.measured.specular_nodes.spectra`; where `brdf` is not known,
    `eval` counts. The percentage is what the table reflects; above 100 % it is 100, and Speos then
    scales the table down. A FormatError says that the path cannot be written, or that bands lie
    outside of 360 to 830 nm.
    """
    check_isotropic(brdf)
    resolution = resolution or Resolution()
    wavelengths, lights = bands(brdf), resolution.lights()
    if not _in_range(wavelengths):
        raise FormatError(f"{path}: cannot be written: Speos takes bands from 360 to 830 nm only")
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        name = printable(" ".join(brdf.name.split())) or _COMMENT
        counts = f"{len(lights)}\t{len(wavelengths)}"
        file.write(f"{_TITLE}\n0\n{name}\n0\n\n1\t0\n1\n{counts}\n")
        file.write(f"{_row(lights)}\n{_row(wavelengths)}\n")
        for light in lights:
            polars, azimuths = resolution.views(float(light))
            values = np.nan_to_num(spectra(brdf, *directions(float(light), polars, azimuths)))
            values = np.clip(values, 0.0, _LARGEST)
            for percent, table in zip(
                100.0 * reflected(values, polars, azimuths), np.moveaxis(values, -1, 0), strict=True
            ):
                file.write(f"{min(percent, 100.0):.6f}\n{len(polars)}\t{len(azimuths)}\n")
                file.write(f"\t{_row(azimuths)}\n")
                for polar, row in zip(polars.tolist(), table.tolist(), strict=True):
                    cells = "\t".join(f"{value:.4e}" for value in row)
                    file.write(f"{polar:.6g}\t{cells}\n")


def _in_range(wavelengths: Floats) -> bool:
    return bool(wavelengths[0] >= _SHORTEST and wavelengths[-1] <= _LONGEST)


def _row(values: Floats) -> str:
    return "\t".join(f"{value:.6g}" for value in values)


_COMMENT = "Scattering surface"
_OLDEST = 7  # version whose layout is the same as today's

FORMAT = Format(
    "Speos BSDF",
    (".brdf",),
    lambda head: head.startswith(b"OPTIS - brdf surface file"),
    load,
    save,
    isotropic=True,
    resolution=Resolution,
    keeps_bands=lambda *_: True,
)
