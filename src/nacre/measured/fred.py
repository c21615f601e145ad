"""Tabulated scatter of FRED as text.

Two header lines; then, for each direction of the light, a line with the polar angle and the azimuth
of its mirror direction, and lines with the polar angle and azimuth of a scattered direction, both
from the normal, and the value. Files that the LOFT group's bsdf-tools write for FRED, which hold
the same measurements as its Zemax files, show the azimuths.
"""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.io.files import PathLike, atomic_path, first_bytes
from nacre.io.format import Format
from nacre.io.text_file import parse_number, parse_numbers, read_lines
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.specular_nodes import ROTATIONS, Resolution, directions
from nacre.sampling import check_isotropic

_SIZE_LIMIT = 1 << 28
_TITLE = "type bsdf_data"
_LARGEST = float(np.finfo(np.float32).max)
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_ANGLES = {"deg": np.pi / 180.0, "rad": 1.0}
_VALUES = {"value": lambda f: f, "log": lambda f: 10.0**f, "log10": lambda f: 10.0**f}


def load(path: PathLike) -> ScatteredBrdf:
    """Read a ``.txt`` file of tabulated scatter; light from several azimuths makes it anisotropic.

    A FormatError says that the file cannot be read, which line is wrong, or which unit is not
    known.
    """
    lines = read_lines(path, _SIZE_LIMIT)
    to_radians, kind, scale = _format(path, lines)
    numbers = array("d")
    light: list[float] = []
    for number, line in lines:
        words = line.split()
        if not words or line.lstrip().startswith(("#", "!", "//")):
            continue
        values = parse_numbers(words, f"{path}: line {number}")
        if len(values) == 2:
            light = values
        elif len(values) == 3 and light:
            numbers.extend([*light, *values])
        else:
            expected = "a light of 2 numbers" if not light else "2 or 3 numbers"
            raise FormatError(f"{path}: line {number}: {len(values)} numbers, expected {expected}")
    if not numbers:
        raise FormatError(f"{path}: holds no samples")
    table = np.frombuffer(numbers, np.float64).reshape(-1, 5)
    angles = table[:, :4] * to_radians
    if np.abs(angles[:, ::2]).max() > np.pi + 1e-6:
        raise FormatError(f"{path}: polar angles: must lie from -180 to 180 degrees")
    with np.errstate(over="ignore"):
        values_ = scale * _VALUES[kind](table[:, 4])
    if not (np.abs(values_) <= _LARGEST).all():
        raise FormatError(f"{path}: a value is too large")
    wi = join(from_spherical(angles[:, 0], angles[:, 1] + np.pi))
    wo = join(from_spherical(angles[:, 2], angles[:, 3]))
    tilted = np.abs(angles[:, 0]) > 1e-6
    isotropic = len(np.unique(np.round(angles[tilted, 1] % (2.0 * np.pi), 6))) <= 1
    rgb = np.repeat(values_[:, None], 3, axis=1)
    where = f"{path}: samples"
    name = Path(path).stem
    return from_measurement(wi, wo, rgb, name, where=where, isotropic=isotropic)


def _format(path: PathLike, lines: object) -> tuple[float, str, float]:
    """Factor to radians, kind of values and their scale, from the header."""
    header: dict[str, str] = {}
    for number, line in lines:  # type: ignore[attr-defined]
        words = line.lower().split()
        if words[:1] == ["format"]:
            header = dict(word.split("=", 1) for word in words[1:] if "=" in word)
            break
        if words and words[:1] != ["type"] and not line.startswith(("#", "!", "//")):
            raise FormatError(f"{path}: line {number}: expected 'format angles=deg bsdf=value'")
    else:
        raise FormatError(f"{path}: has no line 'format angles=deg bsdf=value scale=1'")
    angles, kind = header.get("angles", "deg"), header.get("bsdf", "value")
    for name, value, known in (("angles", angles, _ANGLES), ("bsdf", kind, _VALUES)):
        if value not in known:
            raise FormatError(f"{path}: {name}={value[:40]!r} is not one of {', '.join(known)}")
    try:
        scale = parse_number(header.get("scale", "1"))
    except ValueError as error:
        raise FormatError(f"{path}: scale={header['scale'][:40]!r} is no number") from error
    return _ANGLES[angles], kind, scale


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write tabulated scatter for FRED, whole or not at all: luminance, in degrees.

    Scattered samples of isotropic materials are written as they are; anything else is tabulated,
    every 30 degrees of the azimuth of the light if it is anisotropic.
    """
    check_isotropic(brdf)
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(f"{_TITLE}\nformat angles=deg bsdf=value scale=1\n")
        for light, wo, values in _blocks(brdf, resolution or Resolution()):
            file.write(f"{light[0]:.6g}\t{light[1]:.6g}\n")
            theta, phi = (np.degrees(angle) for angle in to_spherical(split(wo)))
            for row in zip(theta.tolist(), (phi % 360.0).tolist(), values.tolist(), strict=True):
                file.write("{:.6g}\t{:.6g}\t{:.6g}\n".format(*row))


def _blocks(brdf: Brdf, resolution: Resolution) -> list[tuple[tuple[float, float], Floats, Floats]]:
    """Mirror direction in degrees, views (n, 3) and luminance (n,) for each light."""
    blocks = []
    for turn in np.zeros(1) if brdf.isotropic else ROTATIONS[:-1]:
        for light in resolution.lights():
            polars, azimuths = resolution.views(float(light))
            if not brdf.isotropic:
                azimuths = np.union1d(azimuths, (azimuths + 180.0) % 360.0)
            wi, wo = directions(float(light), polars, azimuths[:-1])
            views = _turned(wo.reshape(-1, 3), turn)
            rgb = np.nan_to_num(brdf.eval(_turned(wi, turn), views)).astype(np.float64)
            values = np.clip(rgb @ _LUMINANCE, 0.0, _LARGEST)
            blocks.append(((float(light), float(turn)), views, values))
    return blocks


def _turned(w: Floats, degrees: float) -> Floats:
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = np.moveaxis(w, -1, 0)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=-1)


def _recognize(head: bytes) -> bool:
    return head.lstrip().lower().startswith(_TITLE.encode())


FORMAT = Format(
    "FRED scatter",
    (".fred.txt", ".txt"),
    _recognize,
    load,
    save,
    claims=lambda path: _recognize(first_bytes(path)),  # any text ends in .txt
    resolution=Resolution,
)
