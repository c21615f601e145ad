"""Spectral gonioreflectometer scans of the Cornell Program of Computer Graphics.

Text, as the scenes of pbrt-v2 have it. `#` starts a comment that ends with the line. What remains
are numbers between white space: how many bands there are, their wavelengths in nm, and then for
each sample theta_i, phi_i, theta_s, phi_s in radians and f_r in 1/sr of each band. The incident
direction is `wi`, the scattered one `wo`.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.errors import CUT_SHORT, FormatError
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike
from nacre.io.format import Format
from nacre.io.text_file import parse_number, read_lines
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf

_SIZE_LIMIT = 1 << 28
_BAND_LIMIT = 1024
_REMARK_LIMIT = 1000
_ANGLES = 4


def load(path: PathLike) -> ScatteredBrdf:
    """Read a Cornell ``.brdf`` file, whose comments before the first number name the material.

    Spectra become linear Rec. 709 RGB through :func:`nacre.spectra.to_rgb` and stay
    available as `spectra` and `wavelengths`. The material is taken to be isotropic and mirrored.
    """
    try:
        numbers, whole = _numbers(_lines(path))
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(f"{path}: {str(error)[:40]!r} is no number") from error
    if not whole:
        raise FormatError(f"{path}: the last line does not end; {CUT_SHORT}")
    if not (np.abs(numbers) <= np.finfo(np.float32).max).all():  # also false for NaN
        raise FormatError(f"{path}: values: some are not finite")
    wavelengths, rows = _tables(path, numbers)
    wi, wo = (join(from_spherical(rows[:, k], rows[:, k + 1])).astype(np.float64) for k in (0, 2))
    spectra = rows[:, _ANGLES:]
    title, remarks = _title(_lines(path))
    return from_measurement(
        wi,
        wo,
        None,
        title or Path(path).stem,
        where=f"{path}: samples",
        spectra=spectra,
        wavelengths=wavelengths,
        facts={"remarks": remarks} if remarks else None,
    )


def _lines(path: PathLike) -> Iterator[str]:
    return (line for _, line in read_lines(path, _SIZE_LIMIT))


def _numbers(lines: Iterable[str]) -> tuple[npt.NDArray[np.float64], bool]:
    """All numbers outside comments, and whether the last line ends; the first word that is not a
    number raises a ValueError.
    """
    values = array("d")
    line = "\n"
    for line in lines:
        values.extend(map(parse_number, line.partition("#")[0].split()))
    numbers = np.frombuffer(values) if values else np.empty(0)
    return numbers, line.endswith("\n")


def _tables(
    path: PathLike, numbers: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Wavelengths (bands,) and rows of samples (n, 4 + bands), checked against each other."""
    if not len(numbers):
        raise FormatError(f"{path}: holds no numbers; {CUT_SHORT}")
    if not 1 <= numbers[0] <= _BAND_LIMIT or numbers[0] != int(numbers[0]):
        raise FormatError(f"{path}: number of bands: {numbers[0]:g}, expected 1 to {_BAND_LIMIT}")
    bands = int(numbers[0])
    wavelengths, rest = numbers[1 : bands + 1], numbers[bands + 1 :]
    if len(wavelengths) < bands:
        raise FormatError(f"{path}: wavelengths: {len(wavelengths)} of {bands}; cut short")
    if wavelengths[0] <= 0.0 or not (np.diff(wavelengths) > 0.0).all():
        raise FormatError(f"{path}: wavelengths: must be positive and increase")
    width = _ANGLES + bands
    if not len(rest) or len(rest) % width:
        raise FormatError(
            f"{path}: samples: {len(rest)} numbers, expected a multiple of {width} "
            f"({_ANGLES} angles and {bands} bands each); {CUT_SHORT}"
        )
    rows = rest.reshape(-1, width)
    if rows[:, (0, 2)].min() < 0.0 or rows[:, (0, 2)].max() > math.pi:
        raise FormatError(f"{path}: polar angles: must be radians from 0 to pi")
    if np.abs(rows[:, (1, 3)]).max() > 2.0 * math.pi + 1e-3:
        raise FormatError(f"{path}: azimuths: must be radians of magnitude up to 2 pi")
    return wavelengths, rows


def _title(lines: Iterable[str]) -> tuple[str, str]:
    """Name of the material and other remarks, from the comments at the start."""
    remarks = []
    for line in itertools.islice(lines, _REMARK_LIMIT):
        if not line.startswith("#"):
            break
        remarks.append(line.lstrip("# ").strip())
    about = [r for r in remarks if r and not r.startswith("Cornell University")]
    return (about[0], "; ".join(about[1:])) if about else ("", "")


def _recognize(head: bytes) -> bool:
    return head.startswith(b"#") and any(
        word in head for word in (b"Cornell", b"# wls", b"num wls")
    )


FORMAT = Format("Cornell scan", (".brdf",), _recognize, load)
