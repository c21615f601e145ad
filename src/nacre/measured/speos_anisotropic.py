"""Ansys Speos' anisotropic BSDF files, as text and in binary.

A header; for each angle between the plane of incidence and an anisotropy vector, and for each
incidence, a table over the polar angle and the azimuth of the reflected light, from the mirror
direction, in degrees. Values need only be proportional to f_r: one spectrum says which share of the
light is reflected at one direction of incidence. Ansys Speos help, "Structure of Anisotropic BSDF
Files" and "Anisotropic BSDF Surface Overview", and the files that Speos, Ansys' pyspeos and
converters write. Binary files have the same parts; their arrays are packed (LZ4).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import CUT_SHORT, FormatError, printable
from nacre.io.files import PathLike, atomic_path, read_bytes
from nacre.io.format import Format
from nacre.io.lz4 import unpacked_block
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.specular_nodes import ROTATIONS, Resolution, directions, reflected
from nacre.measured.speos import LEFT_OUT, flag, start, table, without_cosine
from nacre.measured.words import Words
from nacre.sampling import check_isotropic

_KIND = "Anisotropic BSDF surface file"
_TITLE = f"OPTIS - {_KIND} v9.0"
_COMMENT = "Anisotropic scattering surface"
_SIZE_LIMIT = 1 << 28
_MOST_NODES = 4096
_HEADER_LIMIT = 1 << 16  # bytes of comments in a binary file
_LARGEST = 1e30


@dataclass(frozen=True)
class _Table:
    """What is measured for one direction of the light."""

    rotation: float  # degrees from the plane of incidence to the anisotropy vector
    incidence: float  # degrees
    polars: Floats  # degrees, shape (p,)
    azimuths: Floats  # degrees, shape (a,)
    values: Floats  # proportional to f_r, shape (p, a)

    @property
    def total(self) -> float:
        return float(reflected(np.maximum(self.values, 0.0), self.polars, self.azimuths))


@dataclass(frozen=True)
class _Content:
    """A whole file."""

    name: str
    vector: Floats  # of anisotropy, shape (3,)
    reference: tuple[float, float]  # incidence and rotation of the spectrum, in degrees
    spectrum: Floats  # wavelengths in nm and percentages, shape (bands, 2)
    tables: list[_Table]
    notes: list[str]


def load(path: PathLike, as_stored: bool = False) -> ScatteredBrdf:
    """Read the reflection in an ``.anisotropicbsdf`` file; one rotation means an isotropic sample.

    Values are scaled so that the share of light in the file is reflected at the direction that it
    names, unless `as_stored`; a spectrum that is the same everywhere makes no bands. The x and y
    axes are those in which the file gives the vector of anisotropy. A FormatError says that the
    file cannot be read, holds no reflection, or is cut short.
    """
    head = read_bytes(path, _SIZE_LIMIT)
    rest = head.partition(b"\n")[2]
    del head
    binary = rest[:1] == b"1" and rest[1:2] not in (b"\r", b"\n", b"\t", b" ")
    content = _from_binary(path, rest) if binary else _from_text(path)
    wavelengths, percent = content.spectrum.T
    flat = bool(np.ptp(percent) <= 1e-6 * max(float(np.abs(percent).max()), 1e-30))
    shares = np.ones(1) if as_stored else 0.01 * (percent[:1] if flat else percent)
    factors = shares if as_stored else shares / _reference_total(path, content)
    largest = max(float(np.abs(each.values).max()) for each in content.tables)
    if not np.abs(factors).max() * largest <= _LARGEST:
        raise FormatError(f"{path}: reflects nothing at the incidence that its spectrum is for")
    rotations = {each.rotation for each in content.tables}
    isotropic = len(rotations) == 1
    wi, wo, values = [], [], []
    turned = np.degrees(np.arctan2(content.vector[1], content.vector[0]))
    for each in content.tables:
        light, views = directions(each.incidence, each.polars, each.azimuths)
        turn = 0.0 if isotropic else np.radians(turned - each.rotation)
        wi.append(np.broadcast_to(_turned(light, turn), views.shape).reshape(-1, 3))
        wo.append(_turned(views, turn).reshape(-1, 3))
        values.append(each.values.reshape(-1))
    f_r = np.concatenate(values)
    spectra = f_r[:, None] * factors
    colors = len(factors) > 1
    return from_measurement(
        np.concatenate(wi).astype(np.float64),
        np.concatenate(wo).astype(np.float64),
        None if colors else np.repeat(spectra, 3, axis=1),
        content.name or Path(path).stem,
        where=f"{path}: tables",
        isotropic=isotropic,
        spectra=spectra if colors else None,
        wavelengths=wavelengths if colors else None,
        notes=content.notes,
    )


def _turned(directions: Floats, angle: float) -> Floats:
    x, y, z = np.moveaxis(directions, -1, 0)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=-1)


def _reference_total(path: PathLike, content: _Content) -> float:
    """What the values reflect at the incidence of the spectrum, linear between incidences."""
    theta, rotation = content.reference
    nearest = min({t.rotation for t in content.tables}, key=lambda angle: abs(angle - rotation))
    tables = [each for each in content.tables if each.rotation == nearest]
    nodes = np.array([each.incidence for each in tables])
    below = int(np.clip(np.searchsorted(nodes, theta, side="right") - 1, 0, len(nodes) - 1))
    chosen = tables[below : below + 2] if theta > nodes[below] else tables[below : below + 1]
    total = float(np.interp(theta, [t.incidence for t in chosen], [t.total for t in chosen]))
    if total <= 1e-30:
        raise FormatError(f"{path}: tables reflect nothing, so that no share of light scales them")
    return total


def _from_text(path: PathLike) -> _Content:
    words, name = start(path, _KIND, _COMMENT)
    vector = words.numbers(3, "the anisotropy vector")
    sides = [flag(words, side) for side in ("reflection", "transmission")]
    intensities = not flag(words, "kind of values")
    _check_sides(path, sides)
    rotations = _angles(words, "anisotropy angles", 360.0)
    lights = [_angles(words, "incidences", 90.0) for _ in rotations]
    if sides[1]:
        for _ in _angles(words, "anisotropy angles in transmission", 360.0):
            _angles(words, "incidences in transmission", 90.0)
    reference = words.numbers(2, "the direction of the spectrum")
    spectrum = _spectrum(words)
    if sides[1]:
        words.numbers(2, "the direction of the spectrum in transmission")
        _spectrum(words)
    tables = []
    for rotation, incidences in zip(rotations.tolist(), lights, strict=True):
        for incidence in incidences.tolist():
            polars, azimuths, values = table(words)
            values = without_cosine(values, polars) if intensities else values
            tables.append(_Table(rotation, incidence, polars, azimuths, values))
    if not sides[1]:
        words.end("end", "of", "file")
    notes = [LEFT_OUT] if sides[1] else []
    return _Content(name, vector, (reference[0], reference[1]), spectrum, tables, notes)


def _check_sides(path: PathLike, sides: list[bool]) -> None:
    if not sides[0]:
        raise FormatError(f"{path}: holds transmission or nothing; only reflection is read")


def _angles(words: Words, name: str, limit: float) -> Floats:
    angles = words.numbers(words.count(name), name)
    words.check_angles(angles, name, limit)
    return angles


def _spectrum(words: Words) -> Floats:
    """Wavelengths in nm and percentages, behind a line that describes them, which may be empty."""
    words.skip_line()
    count = words.count("wavelengths of the spectrum")
    spectrum = words.numbers(2 * count, "the spectrum").reshape(-1, 2)
    _check_spectrum(words.error, spectrum)
    return spectrum


def _check_spectrum(error: Any, spectrum: Floats) -> None:
    if spectrum[0, 0] <= 0.0 or not (np.diff(spectrum[:, 0]) > 0.0).all():
        raise error("wavelengths of the spectrum: must be positive and increase")
    if spectrum[:, 1].min() < 0.0:
        raise error("spectrum: a percentage is negative")


class _Binary:
    """The parts of a binary file, one after another; a FormatError says that it is cut short."""

    def __init__(self, path: PathLike, data: bytes, place: int) -> None:
        self._path, self._data, self._place = path, data, place

    def error(self, problem: str) -> FormatError:
        return FormatError(f"{self._path}: {problem}")

    def take(self, layout: str) -> tuple[Any, ...]:
        size = struct.calcsize(layout)
        if size > len(self._data) - self._place:
            raise self.error(f"ends within its tables; {CUT_SHORT}")
        found = struct.unpack_from(layout, self._data, self._place)
        self._place += size
        return found

    def count(self, name: str) -> int:
        (count,) = self.take("<I")
        if not 1 <= count <= _MOST_NODES:
            raise self.error(f"{name}: {count}, expected 1 to {_MOST_NODES}")
        return int(count)

    def array(self, count: int, name: str) -> Floats:
        """Numbers in packed blocks."""
        (size,) = self.take("<Q")
        if size != 8 * count:
            raise self.error(f"{name}: {size} bytes, expected {8 * count}")
        data = b""
        while len(data) < size:
            raw, packed = self.take("<II")
            if not 0 < raw <= size - len(data) or packed > len(self._data) - self._place:
                raise self.error(f"{name}: a block of {raw} bytes does not fit; {CUT_SHORT}")
            block = self._data[self._place : self._place + packed]
            self._place += packed
            try:
                data += unpacked_block(block, raw)
            except ValueError as error:
                raise self.error(f"{name}: a packed block {error}; {CUT_SHORT}") from error
        values = np.frombuffer(data, "<f8").astype(np.float64)
        if not (np.abs(values) <= _LARGEST).all():
            raise self.error(f"{name}: a value is not finite")
        return values

    def angles(self, name: str, limit: float) -> Floats:
        angles = self.array(self.count(name), name)
        return self.checked(angles, name, limit)

    def checked(self, angles: Floats, name: str, limit: float) -> Floats:
        if angles[0] < 0.0 or angles[-1] > limit + 1e-3 or not (np.diff(angles) > 0.0).all():
            raise self.error(f"{name}: must increase from 0 to up to {limit:g} degrees")
        return angles


_FIXED = struct.Struct("<3d2?2d2?")
"""Behind the comments: the anisotropy vector; reflection and transmission; two factors; the kind of
values and a flag that is not needed. The number of anisotropy angles and these follow."""


def _from_binary(path: PathLike, data: bytes) -> _Content:
    place = next(_places(data), None)
    if place is None:
        raise FormatError(f"{path}: binary header: has no anisotropy angles where they should be")
    parts = _Binary(path, data, place)
    fixed = parts.take(_FIXED.format)
    vector, sides, intensities = np.array(fixed[:3]), [*fixed[3:5]], not fixed[7]
    _check_sides(path, sides)
    if sides[1]:
        raise FormatError(f"{path}: is binary and holds transmission, too; save it as text")
    rotations = parts.angles("anisotropy angles", 360.0)
    lights = [parts.angles("incidences", 90.0) for _ in rotations]
    reference = parts.take("<2d")
    (described,) = parts.take("<I")
    if described > _HEADER_LIMIT:
        raise parts.error(f"description of the spectrum: {described} bytes; {CUT_SHORT}")
    parts.take(f"<{described}s")
    count = parts.count("wavelengths of the spectrum")
    spectrum = np.array(parts.take(f"<{2 * count}d")).reshape(2, -1).T
    if not (np.isfinite(spectrum).all() and np.isfinite([*reference, *vector]).all()):
        raise parts.error("spectrum: a value is not finite")
    _check_spectrum(parts.error, spectrum)
    tables = []
    for rotation, incidences in zip(rotations.tolist(), lights, strict=True):
        for incidence in incidences.tolist():
            shape = parts.count("polar angles"), parts.count("azimuths")
            polars = parts.checked(parts.array(shape[0], "polar angles"), "polar angles", 90.0)
            azimuths = parts.checked(parts.array(shape[1], "azimuths"), "azimuths", 360.0)
            values = parts.array(shape[0] * shape[1], "a table").reshape(shape)
            values = without_cosine(values, polars) if intensities else values
            tables.append(_Table(rotation, incidence, polars, azimuths, values))
    return _Content("", vector, reference, spectrum, tables, [])


def _places(data: bytes) -> Iterator[int]:
    """Where the fixed part of a binary header can begin: comments of unknown layout precede it."""
    follow = struct.Struct("<IQI")
    for place in range(1, min(len(data) - _FIXED.size - follow.size, _HEADER_LIMIT) + 1):
        count, size, block = follow.unpack_from(data, place + _FIXED.size)
        if not (1 <= count <= _MOST_NODES and size == 8 * count and 0 < block <= size):
            continue
        vector = np.array(_FIXED.unpack_from(data, place)[:3])
        if set(data[place + 24 : place + 26]) <= {0, 1} and 0.01 < np.abs(vector).max() < 100.0:
            yield place


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write a Speos anisotropic BSDF as text, whole or not at all; one rotation if isotropic.

    The tables hold luminance, the spectrum is that of the light reflected at the first incidence:
    the format has one spectrum for all directions. Where `brdf` is not known, `eval` counts.
    """
    check_isotropic(brdf)
    resolution = resolution or Resolution()
    lights = resolution.lights()
    rotations = np.zeros(1) if brdf.isotropic else ROTATIONS
    wavelengths, shares, tables = _tabulated(brdf, resolution, lights, rotations)
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        name = printable(" ".join(brdf.name.split())) or _COMMENT
        file.write(f"{_TITLE}\n0\n{name}\n0\n\n1\t0\t0\n1\t0\n1\n")
        file.write(f"{len(rotations)}\n{_row(rotations)}\n")
        for _ in rotations:
            file.write(f"{len(lights)}\n{_row(lights)}\n")
        file.write(f"{lights[0]:g}\t{rotations[0]:g}\n\n{len(wavelengths)}\n")
        for wavelength, share in zip(wavelengths, shares, strict=True):
            file.write(f"{wavelength:.6g}\t{100.0 * share:.6g}\n")
        for polars, azimuths, values in tables:
            file.write(f"{len(polars)} {len(azimuths)}\n\t{_row(azimuths)}\n")
            for polar, row in zip(polars.tolist(), values.tolist(), strict=True):
                cells = "\t".join(f"{value:.5e}" for value in row)
                file.write(f"{polar:.6g}\t{cells}\n")
        file.write("End of file\n")


def _tabulated(
    brdf: Brdf, resolution: Resolution, lights: Floats, rotations: Floats
) -> tuple[Floats, Floats, list[tuple[Floats, Floats, Floats]]]:
    """Wavelengths, shares of light reflected at the first incidence, and tables of luminance."""
    from nacre.measured.specular_nodes import bands, spectra

    tables, shares = [], None
    luminance = np.array([0.2126, 0.7152, 0.0722])
    for rotation in rotations:
        for light in lights:
            polars, azimuths = resolution.views(float(light))
            if not brdf.isotropic:
                azimuths = np.union1d(azimuths, (azimuths + 180.0) % 360.0)
            wi, wo = directions(float(light), polars, azimuths)
            turn = 0.0 if brdf.isotropic else np.radians(-rotation)
            wi, wo = _turned(wi, turn), _turned(wo, turn)
            rgb = np.nan_to_num(brdf.eval(wi, wo)).astype(np.float64)
            values = np.clip(rgb @ luminance, 0.0, _LARGEST)
            tables.append((polars, azimuths, values))
            if shares is None:
                bright = max(float(reflected(values, polars, azimuths)), 1e-30)
                gray = np.ptp(rgb, axis=-1).max() <= 1e-6 * max(float(rgb.max()), 1e-30)
                if gray:
                    wavelengths, shares = np.array([360.0, 830.0]), np.full(2, bright)
                else:
                    wavelengths = bands(brdf)
                    found = np.clip(np.nan_to_num(spectra(brdf, wi, wo)), 0.0, _LARGEST)
                    shares = np.asarray(reflected(found, polars, azimuths))
                shares = np.minimum(shares, 1.0)
    assert shares is not None
    return wavelengths, shares, tables


def _row(values: Floats) -> str:
    return "\t".join(f"{value:.6g}" for value in values)


FORMAT = Format(
    "Speos anisotropic BSDF",
    (".anisotropicbsdf",),
    lambda head: head[:40].lower().startswith(b"optis - anisotropic bsdf surface file"),
    load,
    save,
    resolution=Resolution,
)
