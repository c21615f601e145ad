"""ASAM OpenMATERIAL 3D: a measured BRDF as a property look-up table.

JSON by the schema `material_brdf_schema.json` of version 1.1.0. Each row of the table is a
wavelength in m, the zenith angle of incidence, the zenith angle and the azimuth of exit relative to
that of incidence, in radians, and f_r in 1/sr. Both directions point away from the surface: at
azimuth 0 light goes back to where it comes from. Materials are isotropic. The solid angle of the
receiver is its aperture. The schema knows no uncertainty, but allows further fields: nacre writes
and reads `standardUncertainties`, in 1/sr, one for each row.
"""

from __future__ import annotations

import hashlib
import json
import math
import uuid
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import FormatError, in_words, printable, reason
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.io.files import PathLike, atomic_path, read_bytes
from nacre.io.format import Format
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.specular_nodes import Resolution, bands, directions, spectra
from nacre.sampling import check_isotropic
from nacre.sampling.apertures import half_angle, solid_angle

VERSION = "1.1.0"  # of the specification that written files follow

_SIZE_LIMIT = 1 << 28
_BAND_LIMIT = 1024
_COLUMNS = 5
_SOLID_ANGLES, _UNCERTAINTY = "receiverSolidAngles", "standardUncertainties"
_LONGEST = 17.16e-3  # m; the schema's
_LARGEST = float(np.finfo(np.float32).max)
_TURN = 6.283185  # rad; the schema's largest azimuth
_SLACK = 1e-4  # radians by which angles may exceed their range
_OTHER_TABLES = {
    "opticalProperties": "indices of refraction",
    "electromagneticProperties": "electromagnetic properties",
    "reflectionCoefficients": "reflection coefficients for radar",
}
"""Tables of other kinds, by what they are called in files."""
_SPACE = uuid.UUID("9a1f43f2-6f0c-4c8c-9d9f-0d2d6b7f6a10")
"""Of the names that identifiers of written files are made from."""


def load(path: PathLike) -> ScatteredBrdf:
    """Read a ``_brdf.xompt`` file of scattered samples, or the one that a ``.xomp`` material names.

    Samples must be at the same directions for every wavelength. Rows with a null are left out. A
    FormatError says that the file cannot be read, is not JSON or is another look-up table, or that
    a value is missing or out of range.
    """
    content = _read(path)
    if isinstance(content.get("materialProperties"), dict):
        return _of_material(path, content["materialProperties"])
    return _from_table(path, content)


def _from_table(path: PathLike, content: dict[str, Any]) -> ScatteredBrdf:
    metadata = content.get("metadata")
    if not isinstance(metadata, dict):
        raise FormatError(f"{path}: metadata: missing")
    brdf = content.get("brdf")
    if not isinstance(brdf, dict) or not isinstance(brdf.get("lookupTable"), list):
        known = [text for key, text in _OTHER_TABLES.items() if key in content]
        if known:
            raise FormatError(f"{path}: holds {known[0]}, no reflectance")
        held = ", ".join(str(key) for key in content if key not in ("metadata", "$schema"))
        raise FormatError(f"{path}: brdf.lookupTable: missing (the file has: {held[:80]})")
    rows, nulls = _rows(path, brdf["lookupTable"], brdf.get(_UNCERTAINTY))
    wavelengths, angles, values, sigma = _matrix(path, rows)
    theta_i, theta_o, phi = angles.T
    wi, wo = join(from_spherical(theta_i, 0.0 * phi)), join(from_spherical(theta_o, phi))
    known = [key for key in ("sources", "license") if key in metadata]
    facts: dict[str, Any] = {key: printable(str(metadata[key])[:200]) for key in known}
    name = metadata.get("name")
    if not isinstance(name, str) or not name:
        name = Path(path).stem.removesuffix("_brdf")
    return from_measurement(
        wi.astype(np.float64),
        wo.astype(np.float64),
        None,
        printable(name),
        where=f"{path}: lookupTable",
        spectra=values,
        wavelengths=wavelengths,
        sigma=sigma,
        apertures=_apertures(path, brdf),
        facts=facts | {"dropped as null": nulls},
    )


def _of_material(path: PathLike, properties: dict[str, Any]) -> ScatteredBrdf:
    """The first table of reflectance that a material refers to and that lies beside it."""
    listed = properties.get("brdfUris")
    if not isinstance(listed, list) or not listed:
        raise FormatError(f"{path}: materialProperties: names no table of reflectance (brdfUris)")
    folder = Path(path).parent
    for uri in listed:
        if not isinstance(uri, str) or not uri or Path(uri).name != uri:
            shown = printable(str(uri)[:80])
            raise FormatError(f"{path}: brdfUris: {shown!r} is not the name of a file beside it")
    found = [folder / uri for uri in listed if (folder / uri).is_file()]
    if not found:
        names = ", ".join(listed)[:200]
        raise FormatError(f"{path}: brdfUris: none of {printable(names)} lies beside it")
    brdf = _from_table(found[0], _read(found[0]))
    notes = [f"The table is {found[0].name}, which {Path(path).name} names."]
    if others := [uri for uri in listed if uri != found[0].name]:
        notes.append(f"It also names {printable(in_words(others[:8]))}, which is left out.")
    return brdf.replaced(notes=(*notes, *brdf.notes))


def _read(path: PathLike) -> dict[str, Any]:
    data = read_bytes(path, _SIZE_LIMIT)
    try:
        content = json.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: is not UTF-8 text") from error
    except (ValueError, RecursionError) as error:
        raise FormatError(
            f"{path}: is not whole JSON, or something else: {reason(error)}"
        ) from error
    if not isinstance(content, dict):
        raise FormatError(f"{path}: is JSON, but no OpenMATERIAL 3D file")
    return content


def _rows(path: PathLike, table: list[Any], uncertainty: Any) -> tuple[Floats, int]:
    """Rows without a null, checked, and how many had one; shape (n, 5), or (n, 6) with standard
    uncertainties.
    """
    kept = []
    if uncertainty is not None and not (
        isinstance(uncertainty, list)
        and len(uncertainty) == len(table)
        and all(type(value) in (int, float) and 0.0 <= value <= _LARGEST for value in uncertainty)
    ):
        raise FormatError(f"{path}: {_UNCERTAINTY}: expected {len(table)} numbers from 0 up")
    for number, row in enumerate(table):
        if not isinstance(row, list) or len(row) != _COLUMNS:
            raise FormatError(f"{path}: lookupTable: row {number}: expected {_COLUMNS} numbers")
        if None in row:
            continue
        if not all(type(value) in (int, float) and abs(value) <= _LARGEST for value in row):
            raise FormatError(f"{path}: lookupTable: row {number}: expected finite numbers")
        kept.append(row if uncertainty is None else [*row, uncertainty[number]])
    if not kept:
        raise FormatError(f"{path}: lookupTable: holds no samples")
    rows = np.array(kept, np.float64)
    limits = (_LONGEST, 0.5 * math.pi, 0.5 * math.pi, 2.0 * math.pi)
    for column, (name, limit) in enumerate(
        zip(("wavelength", "incidence", "exit zenith", "exit azimuth"), limits, strict=True)
    ):
        wrong = (rows[:, column] < 0.0) | (rows[:, column] > limit + _SLACK)
        if wrong.any():
            value = rows[int(wrong.argmax()), column]
            raise FormatError(f"{path}: lookupTable: {name} {value:g}, expected 0 to {limit:g}")
    return rows, len(table) - len(kept)


def _matrix(path: PathLike, rows: Floats) -> tuple[Floats, Floats, Floats, Floats | None]:
    """Wavelengths in nm (b,), angles (n, 3), values (n, b), and the largest standard uncertainty of
    a pair of directions (n,), where there is one.
    """
    wavelengths, band = np.unique(1e9 * rows[:, 0], return_inverse=True)
    if rows[:, 0].min() < 1e-9 or len(wavelengths) > _BAND_LIMIT:
        limits = f"1 to {_BAND_LIMIT} wavelengths from 1e-09 m"
        raise FormatError(f"{path}: lookupTable: expected {limits}")
    order = np.lexsort((rows[:, 3], rows[:, 2], rows[:, 1], band))
    count = len(rows) // len(wavelengths)
    sorted_rows = rows[order]
    if count * len(wavelengths) == len(rows):
        parts = sorted_rows.reshape(len(wavelengths), count, -1)
        if (1e9 * parts[:, :, 0] == wavelengths[:, None]).all() and np.allclose(
            parts[:, :, 1:4], parts[:1, :, 1:4], rtol=0.0, atol=_SLACK
        ):
            sigma = parts[:, :, _COLUMNS].max(axis=0) if rows.shape[1] > _COLUMNS else None
            return wavelengths, parts[0, :, 1:4], np.ascontiguousarray(parts[:, :, 4].T), sigma
    raise FormatError(f"{path}: lookupTable: has other directions at every wavelength; not read")


def _apertures(path: PathLike, brdf: dict[str, Any]) -> Floats | None:
    """Half angles of source and receiver in radians, (2,): the median of those of wavelengths."""
    listed = brdf.get(_SOLID_ANGLES)
    if listed is None:
        return None
    if not isinstance(listed, list):
        raise FormatError(f"{path}: {_SOLID_ANGLES}: is no list")
    angles = [entry.get("solidAngle") if isinstance(entry, dict) else None for entry in listed]
    known = [a for a in angles if isinstance(a, int | float) and 0.0 < a < 2.0 * math.pi]
    if len(known) < len(angles):
        raise FormatError(f"{path}: {_SOLID_ANGLES}: solidAngle: must lie between 0 and 2 pi")
    return np.array([0.0, half_angle(float(np.median(known)))]) if known else None


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write a ``.xompt`` file of an isotropic reflectance, whole or not at all.

    Samples of a scan that was read are written as they are, if it has spectra and no resolution is
    given. Anything else is sampled first, where it is known, in the bands that
    :func:`nacre.measured.specular_nodes.spectra` gives. Material files (``.xomp``) refer to names
    that end in ``_brdf.xompt`` only.
    """
    wi: Floats
    wo: Floats
    values: Floats
    wavelengths: Floats
    scan = brdf if isinstance(brdf, ScatteredBrdf) and resolution is None else None
    if scan is not None and scan.spectra is not None:
        wi, wo, values = scan.samples.wi, scan.samples.wo, np.asarray(scan.spectra)
        wavelengths = np.asarray(scan.wavelengths, np.float64)
    else:
        check_isotropic(brdf)
        wi, wo, values = _sampled(brdf, resolution or Resolution())
        wavelengths = bands(brdf)
    if not len(values):
        raise FormatError(f"{path}: cannot be written: the material is not known anywhere")
    rows, order = np.unique(_angles(wi, wo), axis=0, return_index=True)
    written = [", ".join(f"{angle:.6f}" for angle in row) for row in rows.tolist()]
    head = {"$schema": _SCHEMA, "metadata": _metadata(brdf, Path(path), values)}
    text = json.dumps(head, indent=2, ensure_ascii=False)
    meters = [float(f"{1e-9 * wavelength:.9g}") for wavelength in wavelengths]
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(f'{text[:-2]},\n  "brdf": {{\n    "wavelengths": {json.dumps(meters)},\n')
        if scan is not None and scan.samples.apertures is not None:
            wide = solid_angle(float(np.median(scan.samples.apertures[:, 1])))
            receivers = [{"wavelength": length, "solidAngle": wide} for length in meters]
            if wide > 0.0:
                file.write(f'    "{_SOLID_ANGLES}": {json.dumps(receivers)},\n')
        if scan is not None and scan.samples.sigma is not None:
            spread = [float(f"{value:.6g}") for value in scan.samples.sigma[order].tolist()]
            file.write(f'    "{_UNCERTAINTY}": {json.dumps(spread * len(meters))},\n')
        file.write('    "lookupTable": [')
        mark = "\n"
        for length, band in zip(meters, np.clip(values.T, 0.0, _LARGEST), strict=True):
            for angles, value in zip(written, band[order].tolist(), strict=True):
                file.write(f"{mark}[{length!r}, {angles}, {value:.6g}]")
                mark = ",\n"
        file.write("\n    ]\n  }\n}\n")


def _sampled(brdf: Brdf, resolution: Resolution) -> tuple[Floats, Floats, Floats]:
    """Directions (n, 3) twice and spectra (n, bands) at the nodes where `brdf` is known."""
    parts = []
    for light in resolution.lights():
        wi, wo = directions(light, *resolution.views(light))
        wi, wo = (w.reshape(-1, 3).astype(np.float64) for w in np.broadcast_arrays(wi, wo))
        values = spectra(brdf, wi, wo)
        known = brdf.valid(wi, wo) & np.isfinite(values).all(axis=-1)
        parts.append((wi[known], wo[known], values[known]))
    lights, views, found = zip(*parts, strict=True)
    return np.concatenate(lights), np.concatenate(views), np.concatenate(found)


def _angles(wi: Floats, wo: Floats) -> Floats:
    """Zenith angles of incidence and exit, and the azimuth between or 0, to 1e-6 rad; (n, 3)."""
    (theta_i, phi_i), (theta_o, phi_o) = (to_spherical(split(w)) for w in (wi, wo))
    angles = np.stack([theta_i, theta_o, np.mod(phi_o - phi_i, 2.0 * math.pi)], axis=1)
    angles = np.floor(1e6 * angles + 0.5) / 1e6
    free = (angles[:, :2] == 0.0).any(axis=1) | (angles[:, 2] > _TURN)
    angles[free, 2] = 0.0
    return angles


def _metadata(brdf: Brdf, path: Path, values: Floats) -> dict[str, Any]:
    name = printable(" ".join(brdf.name.split())) or path.stem
    source = dict(brdf.source or {}).get("file", "")
    content = hashlib.sha256(np.ascontiguousarray(values, "<f4").tobytes()).hexdigest()
    return {
        "name": name,
        "uuid": str(uuid.uuid5(_SPACE, f"{name} {content}")),
        "materialVersion": "1.0.0",
        "openMaterial3dVersion": VERSION,
        "copyrights": ["that of the source"],
        "license": "that of the source",
        "authors": ["unknown"],
        "sources": f"tabulated by nacre from {printable(source)}"
        if source
        else "tabulated by nacre",
        "typicalSensorTechnology": "camera",
    }


_SCHEMA = (
    "https://raw.githubusercontent.com/asam-ev/OpenMATERIAL-3D/refs/tags/v1.1.0/schemas/"
    "material_brdf_schema.json"
)

FORMAT = Format(
    "OpenMATERIAL 3D",
    (".xompt",),
    None,
    load,
    save,
    isotropic=True,
    resolution=Resolution,
    keeps_bands=lambda *_: True,
)
MATERIAL = Format("OpenMATERIAL 3D material", (".xomp",), None, load)
