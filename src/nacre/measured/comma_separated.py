"""Scattered samples of reflectance as text: comma-separated values and ASTM E1392 files.

UTF-8 text. Header lines come first: `# key: value`, or without the mark. Then one line names the
columns, in any order, and every further line is one sample: the angles theta_i, phi_i (light) and
theta_o, phi_o (viewer), and f_r in 1/sr as r, g, b (linear Rec. 709), as x, y, z (CIE 1931), as f
alone (gray), or one column a band, named by its wavelength in nm; where there is a column sigma, it
is the standard deviation of the noise of these. Apertures stand in the header, "source aperture:
0.5 deg", or in columns. See :mod:`nacre.measured.sample_columns`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import xyz_to_rgb
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.io.files import PathLike, atomic_path
from nacre.io.format import Format
from nacre.io.head import recognized_head
from nacre.io.text_file import parse_number, read_lines
from nacre.measured.deduplication import from_measurement
from nacre.measured.sample_columns import (
    ANGLES,
    APERTURES,
    NOISE,
    Columns,
    read_header,
    read_table,
)
from nacre.measured.scattered import ScatteredBrdf, tabulate
from nacre.sampling.apertures import half_angle

_SIZE_LIMIT = 1 << 28
_COUNTS = ("samples", "num_points")  # header keys of the number of samples: ours, and ASTM's
_COVERAGE = "coverage factor"  # header key: column sigma is this times a standard deviation
_BANDWIDTH = "bandwidth"  # header key: width of bands at half their height, "10 nm"
_USED = (
    "units",
    "values",
    _COVERAGE,
    _BANDWIDTH,
    *_COUNTS,
    *(name.replace("_", " ") for name in APERTURES),
)
_NAMES = rb"theta_i\b", rb"phi_i\b", rb"theta_[osr]\b", rb"phi_[osr]\b"
"""Names of columns that tables of this kind have; others are read as those of goniometers."""
_LARGEST = 3.4028234e38  # of what is written: below the largest float32, which nine digits round up

_Array = npt.NDArray[np.float64]


def load(path: PathLike) -> ScatteredBrdf:
    """Read a ``.csv`` or ``.astm`` file of scattered samples.

    A FormatError says that the file cannot be read, a column or the unit of the angles is missing,
    a value is not a finite number, or there are not as many samples as the header says.
    """
    lines = read_lines(path, _SIZE_LIMIT)
    header, columns = read_header(path, lines)
    table, left_out = read_table(path, lines, columns)
    _check_count(path, header, len(table))
    polar, azimuth = (
        np.stack([table[:, columns.names.index(name)] * columns.scales[name] for name in pair])
        for pair in (ANGLES[::2], ANGLES[1::2])
    )
    if polar.min() < 0.0 or polar.max() > math.pi * (1.0 + 1e-6):
        raise FormatError(f"{path}: polar angles: must lie from 0 to 180 degrees; check the units")
    wi, wo = (join(w).astype(np.float64) for w in map(from_spherical, polar, azimuth))
    rgb, spectra, wavelengths = _values(table, columns)
    sigma = _sigma(path, header, table, columns, rgb if spectra is None else spectra)
    return from_measurement(
        wi,
        wo,
        rgb,
        header.pop("name", "") or Path(path).stem,
        where=f"{path}: samples",
        isotropic=_flag(path, header, "isotropic"),
        spectra=spectra,
        wavelengths=wavelengths,
        sigma=sigma,
        apertures=_apertures(path, header, table, columns),
        bandwidth=_bandwidth(path, header),
        facts={f"header {key}": value for key, value in header.items() if key not in _USED}
        | ({"rows without values": left_out} if left_out else {}),
    )


def save(brdf: Brdf, path: PathLike) -> None:
    """Write samples of any reflectance, whole or not at all, in degrees, as bands or linear RGB.

    The samples of a :class:`ScatteredBrdf` are written as they are: what this function wrote is
    written again byte for byte. Anything else is sampled first (see
    :func:`nacre.measured.scattered.tabulate`). A FormatError says that the path cannot be written,
    or that `brdf` is not known anywhere.
    """
    try:
        scan = brdf if isinstance(brdf, ScatteredBrdf) else tabulate(brdf)
    except ValueError as error:
        raise FormatError(f"{path}: cannot be written: {error}") from error
    names, values = _columns(scan)
    isotropic = f"isotropic: {'yes' if brdf.isotropic else 'no'}"
    header = [isotropic, f"samples: {len(values)}", *_stated(scan)]
    _write(path, brdf.name, header, names, [(scan.samples.wi, scan.samples.wo, values)])


def save_plan(
    wi: Floats,
    wo: Floats,
    path: PathLike,
    *,
    name: str,
    header: Sequence[str] = (),
    measured: ScatteredBrdf | None = None,
) -> None:
    """Write pairs of directions whose values are to be filled in, whole or not at all.

    :func:`load` reads the `.csv` file once one or more rows have values. `wi` and `wo` are unit
    directions to the light and to the viewer, shape (n, 3); `name` is the material's; `header` has
    further lines, without the mark. Rows that are `measured` already come first. A FormatError says
    that the path cannot be written.
    """
    names, values = (list("rgb"), None) if measured is None else _columns(measured)
    blocks = [] if measured is None else [(measured.samples.wi, measured.samples.wo, values)]
    header = ["isotropic: yes", *header, *([] if measured is None else _stated(measured))]
    _write(path, name, header, names, [*blocks, (wi, wo, None)])


def _columns(scan: ScatteredBrdf) -> tuple[list[str], _Array]:
    """Names of the columns beside the angles, and their values, one row per sample."""
    samples, wavelengths, spectra = scan.samples, scan.wavelengths, scan.spectra
    if spectra is None or wavelengths is None:
        names, values = list("rgb"), samples.rgb
    else:
        names, values = [f"{w:.10g} nm" for w in wavelengths], spectra
    if samples.sigma is not None:
        names, values = [*names, NOISE], np.column_stack([values, samples.sigma])
    if samples.apertures is not None and np.ptp(samples.apertures, axis=0).any():
        names = [*names, *(f"{name} [deg]" for name in APERTURES)]
        values = np.column_stack([values, np.round(np.degrees(samples.apertures), 9)])
    return names, np.clip(values, -_LARGEST, _LARGEST)


def _stated(scan: ScatteredBrdf) -> list[str]:
    """Header lines for the bandwidth, and for the apertures if all samples have the same ones."""
    bands = [f"{_BANDWIDTH}: {scan.bandwidth:.10g} nm"] if scan.bandwidth else []
    apertures = scan.samples.apertures
    if apertures is None or np.ptp(apertures, axis=0).any():
        return bands
    degrees = np.round(np.degrees(apertures[0]), 9)
    pairs = zip(APERTURES, degrees, strict=True)
    return [*bands, *(f"{name.replace('_', ' ')}: {angle:.10g} deg" for name, angle in pairs)]


def _bandwidth(path: PathLike, header: dict[str, str]) -> float:
    text = header.get(_BANDWIDTH, "0")
    try:
        found = parse_number(text.removesuffix("nm").strip())
    except ValueError:
        found = -1.0
    if not 0.0 <= found <= 1e4:
        raise FormatError(f"{path}: header '{_BANDWIDTH}': {text[:40]!r}, expected one like 10 nm")
    return found


def _write(
    path: PathLike,
    name: str,
    header: Sequence[str],
    names: Sequence[str],
    blocks: Iterable[tuple[Floats, Floats, _Array | None]],
) -> None:
    """Write rows of directions (n, 3) and values (n, columns); without values, empty cells."""
    name = " ".join(name.split())
    header = [f"name: {name}", "units: degrees", header[0], "values: f_r in 1/sr", *header[1:]]
    with (
        atomic_path(path) as temporary,
        temporary.open("w", encoding="utf-8", errors="replace", newline="") as file,
    ):
        file.writelines(f"# {line}\n" for line in header)
        file.write(",".join((*ANGLES, *names)) + "\n")
        for wi, wo, values in blocks:
            pair = split(wi.astype(np.float64)), split(wo.astype(np.float64))
            angles = [angle for w in pair for angle in to_spherical(w)]
            digits = 7 if values is not None else 4  # float32 knows no more
            degrees = np.round(np.degrees(np.stack(angles, axis=1)), digits) + 0.0  # no -0
            for index, row in enumerate(degrees):
                own = [""] * len(names) if values is None else [f"{x:.9g}" for x in values[index]]
                file.write(",".join((*(f"{x:.10g}" for x in row), *own)) + "\n")


def _check_count(path: PathLike, header: dict[str, str], found: int) -> None:
    for key in _COUNTS:
        stated = header.get(key, str(found))
        if not stated.isdecimal():
            raise FormatError(f"{path}: header '{key}': {stated[:40]!r}, expected a whole number")
        if stated.lstrip("0") != str(found):
            raise FormatError(
                f"{path}: holds {found} samples, but header '{key}' says {stated[:40]}; the file "
                "is cut short or was edited"
            )


def _values(table: _Array, columns: Columns) -> tuple[_Array | None, _Array | None, _Array | None]:
    """Linear RGB, or spectra and wavelengths."""

    def pick(names: Iterable[str]) -> _Array:
        return table[:, [columns.names.index(name) for name in names]]

    if bands := columns.bands:
        spectra, wavelengths = pick(bands), np.array(bands, np.float64)
        return None, spectra, wavelengths
    if "f" in columns.names:
        return pick("fff"), None, None
    return (xyz_to_rgb(pick("xyz")) if "x" in columns.names else pick("rgb")), None, None


def _sigma(
    path: PathLike, header: dict[str, str], table: _Array, columns: Columns, values: _Array | None
) -> _Array | None:
    """Standard deviations (n,) of values (n, channels); None where no column has them."""
    if NOISE not in columns.names or values is None:
        return None
    sigma = table[:, columns.names.index(NOISE)]
    if sigma.min() < 0.0:
        raise FormatError(f"{path}: column {NOISE}: a standard deviation is negative")
    factor = header.get(_COVERAGE, "1")
    try:
        coverage = parse_number(factor)
    except ValueError:
        coverage = math.nan
    if not 0.0 < coverage < math.inf:
        raise FormatError(f"{path}: header '{_COVERAGE}': {factor[:40]!r}, expected one like 2")
    if columns.percent:
        sigma = 0.01 * sigma * np.maximum(values, 0.0).mean(axis=1)
    return np.asarray(sigma / coverage)


def _apertures(
    path: PathLike, header: dict[str, str], table: _Array, columns: Columns
) -> _Array | None:
    """Half angles of source and detector in radians, shape (n, 2); None where nothing says them."""
    found = np.zeros((len(table), 2))
    for side, name in enumerate(APERTURES):
        key = name.replace("_", " ")
        if name in columns.names:
            values, scale = table[:, columns.names.index(name)], columns.scales[name]
        elif key in header:
            values, scale = _aperture(path, key, header[key])
        else:
            continue
        limit = 2.0 * math.pi if scale == 0.0 else 0.5 * math.pi / scale
        if values.min() < 0.0 or values.max() >= limit:
            raise FormatError(
                f"{path}: {key}: must be half an angle from 0 to less than 90 degrees"
            )
        found[:, side] = half_angle(values) if scale == 0.0 else scale * values
    return found if found.any() else None


_APERTURE = re.compile(r"([0-9.eE+-]+)\s*(degrees|degree|deg|°|radians|rad|sr)")


def _aperture(path: PathLike, key: str, text: str) -> tuple[_Array, float]:
    """The number and the factor to radians, 0 for a solid angle, of a header line."""
    match = _APERTURE.fullmatch(text)
    try:
        number = parse_number(match[1]) if match else math.nan
    except ValueError:
        number = math.nan
    if match is None or not math.isfinite(number):
        expected = "half the angle, like 2.5 deg, or the solid angle, like 0.006 sr"
        raise FormatError(f"{path}: header '{key}': {text[:40]!r}, expected {expected}")
    scale = {"sr": 0.0, "rad": 1.0, "radians": 1.0}.get(match[2], math.pi / 180.0)
    return np.array([number]), scale


def _flag(path: PathLike, header: dict[str, str], key: str) -> bool:
    value = header.pop(key, "yes").lower()
    if value not in {"yes", "no"}:
        raise FormatError(f"{path}: header '{key}': {value[:40]!r}, expected yes or no")
    return value == "yes"


def _recognize(head: bytes) -> bool:
    text = head.lstrip().lower()
    if text.startswith(b"tensor_file"):  # has fields of such names
        return False
    return text.startswith(b"astm") or all(re.search(name, text) for name in _NAMES)


FORMAT = Format(
    "comma-separated samples",
    (".csv",),
    _recognize,
    load,
    save,
    keeps_bands=lambda brdf, path, anew: True,
    keeps_uncertainty=True,
    claims=lambda path: _recognize(recognized_head(path)),
)
ASTM = Format("ASTM E1392 samples", (".astm",), None, load)
