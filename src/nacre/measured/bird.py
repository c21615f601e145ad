"""The universal BRDF file of the European metrology institutes: JSON with metadata and lists.

Each variable is a list with a unit: angles, wavelengths, polarization, f_r in 1/sr and its
uncertainty. What is read is f_r for unpolarized light; the metadata and what else a file holds are
kept, and written back. BiRD project, "Universal BRDF data format", schemas 1.0
(github.com/BiRD-project/BiRD_view).
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import FormatError, in_words, printable, reason
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.io.files import PathLike, read_bytes, write_encoded
from nacre.io.format import Format
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf, tabulate
from nacre.measured.specular_nodes import bands as spectral_bands
from nacre.measured.specular_nodes import spectra as spectra_of
from nacre.sampling.apertures import half_angle

_SIZE_LIMIT = 1 << 28
_LARGEST = float(np.finfo(np.float32).max)
_SCHEMA = (
    "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/"
    "BRDF_JSON_schema/brdf_json_schema_v1.0.json"
)
_UNKNOWN = "not stated"
_ANGLES = "theta_i", "phi_i", "theta_r", "phi_r"
_DEGREES = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "degrees": math.pi / 180.0, "rad": 1.0}
_LENGTHS = {"nm": 1.0, "μm": 1000.0, "µm": 1000.0, "um": 1000.0}
_POLARIZED = {"s": 1.0, "p": -1.0, "u": 0.0}  # second element of the Stokes vector

_Array = npt.NDArray[np.float64]


class BirdBrdf(ScatteredBrdf):
    """Scattered samples with everything else that their file says.

    `document` is the content of the file as JSON has it; its data are not used.
    """

    document: Mapping[str, Any] | None = None


def load(path: PathLike) -> ScatteredBrdf:
    """Read a ``.brdf`` file of the BiRD project.

    Pairs of directions that are measured with s- and p-polarized light are averaged. A FormatError
    says that the file cannot be read, or which list or unit is missing or wrong.
    """
    document = _document(path)
    data, metadata = document["data"], document["metadata"]
    count = len(_list(path, data, "BRDF"))
    angles = {name: _angles(path, data, name, count) for name in _ANGLES if name in data}
    for name in ("theta_i", "theta_r"):
        if name not in angles:
            raise FormatError(f"{path}: data: {name} is missing")
    f_r = _numbers(path, data, "BRDF", count)
    if (unit := _unit(data, "BRDF")) not in ("1/sr", "sr^-1", "sr-1"):
        raise FormatError(f"{path}: data: BRDF: unit {unit[:40]!r}, expected 1/sr")
    zero = np.zeros(count)
    directions = np.stack([angles.get(name, zero) for name in _ANGLES], axis=1)
    wavelengths = _wavelengths(path, data, count)
    polarized, notes = _polarization(path, data, count)
    sigma = _uncertainty(path, data, f_r)
    pairs, spectra, bands, spread, incomplete = _arranged(
        path, directions, f_r, wavelengths, polarized, sigma
    )
    if incomplete:
        notes.append(
            f"{incomplete} pairs of directions were measured with one linear polarization alone, "
            "which is taken for unpolarized light."
        )
    wi = join(from_spherical(pairs[:, 0], pairs[:, 1]))
    wo = join(from_spherical(pairs[:, 2], pairs[:, 3]))
    sample = metadata.get("sample")
    sample = sample if isinstance(sample, dict) else {}
    tilted = pairs[:, 0] > 1e-6
    turns = len(np.unique(np.round(pairs[tilted, 1], 6)))
    symmetry = sample.get("properties_symmetry")
    isotropic = symmetry == "isotropic" or (symmetry is None and turns <= 1)
    other = [name for name in data if name not in (*_ANGLES, "BRDF", "uBRDF", *_USED)]
    if other:
        notes.append(f"The file also lists {in_words(other[:8])}, which is kept.")
    scan = from_measurement(
        wi,
        wo,
        np.repeat(spectra, 3, axis=1) if bands is None else None,
        printable(str(sample.get("name") or ""))[:200] or Path(path).stem,
        where=f"{path}: data",
        isotropic=isotropic,
        spectra=None if bands is None else spectra,
        wavelengths=bands,
        sigma=spread,
        apertures=_apertures(path, metadata),
        facts=_facts(metadata),
        notes=notes,
    )
    made = BirdBrdf(
        scan.samples.wi,
        scan.samples.wo,
        scan.samples.rgb,
        scan.name,
        isotropic=isotropic,
        spectra=scan.spectra,
        wavelengths=scan.wavelengths,
        sigma=scan.samples.sigma,
        apertures=scan.samples.apertures,
        facts=_facts(metadata),
    )
    return made.replaced(channels=scan.channels, notes=scan.notes, document=document)


_USED = "wavelength_i", "wavelength_r", "polarization_i"


def _document(path: PathLike) -> dict[str, Any]:
    try:
        content = json.loads(read_bytes(path, _SIZE_LIMIT).decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{path}: is not whole JSON: {reason(error)}") from error
    if not isinstance(content, dict):
        raise FormatError(f"{path}: is JSON, but no BRDF file")
    for section in ("metadata", "data"):
        if not isinstance(content.get(section), dict):
            raise FormatError(f"{path}: {section}: missing")
    return content


def _list(path: PathLike, data: Mapping[str, Any], name: str) -> list[Any]:
    entry = data.get(name)
    values = entry.get("values") if isinstance(entry, dict) else None
    if not isinstance(values, list) or not values:
        raise FormatError(f"{path}: data: {name}: has no list of values")
    return values


def _unit(data: Mapping[str, Any], name: str) -> str:
    return str(data[name].get("unit", ""))


def _numbers(path: PathLike, data: Mapping[str, Any], name: str, count: int) -> _Array:
    values = _list(path, data, name)
    if len(values) != count:
        raise FormatError(f"{path}: data: {name}: {len(values)} values, expected {count}")
    if not all(type(v) in (int, float) and abs(v) <= _LARGEST for v in values):
        raise FormatError(f"{path}: data: {name}: a value is no finite number")
    return np.array(values, np.float64)


def _angles(path: PathLike, data: Mapping[str, Any], name: str, count: int) -> _Array:
    unit = _unit(data, name)
    if unit not in _DEGREES:
        known = ", ".join(_DEGREES)
        raise FormatError(f"{path}: data: {name}: unit {unit[:40]!r} is not one of {known}")
    angles = _DEGREES[unit] * _numbers(path, data, name, count)
    if name.startswith("theta") and (angles.min() < 0.0 or angles.max() > 0.5 * math.pi + 1e-6):
        raise FormatError(f"{path}: data: {name}: must lie from 0 to 90 degrees")
    return np.asarray(angles)


def _wavelengths(path: PathLike, data: Mapping[str, Any], count: int) -> _Array | None:
    for name in ("wavelength_i", "wavelength_r"):
        if name in data:
            unit = _unit(data, name)
            if unit not in _LENGTHS:
                known = ", ".join(_LENGTHS)
                raise FormatError(f"{path}: data: {name}: unit {unit[:40]!r} is not one of {known}")
            found = _LENGTHS[unit] * _numbers(path, data, name, count)
            if found.min() <= 0.0:
                raise FormatError(f"{path}: data: {name}: must be positive")
            return np.asarray(found)
    return None


def _polarization(path: PathLike, data: Mapping[str, Any], count: int) -> tuple[_Array, list[str]]:
    """How s-polarized the light is, from -1 to 1, and what to say about it."""
    if "polarization_i" not in data:
        return np.zeros(count), []
    values = _list(path, data, "polarization_i")
    if len(values) != count:
        raise FormatError(f"{path}: data: polarization_i: {len(values)} values, expected {count}")
    degree = []
    for value in values:
        if isinstance(value, str) and value in _POLARIZED:
            degree.append(_POLARIZED[value])
        elif isinstance(value, list) and len(value) == 4 and type(value[1]) in (int, float):
            degree.append(float(value[1]))
        else:
            shown = printable(str(value)[:40])
            problem = f"{shown!r} is neither s, p or u nor a Stokes vector"
            raise FormatError(f"{path}: data: polarization_i: {problem}")
    found = np.array(degree)
    if not np.abs(found).max() > 0.0:
        return found, []
    return found, ["f_r is the mean for light polarized across and along the plane of incidence."]


def _uncertainty(path: PathLike, data: Mapping[str, Any], f_r: _Array) -> _Array | None:
    """Standard uncertainty of f_r in 1/sr; None where the file has none."""
    if "uBRDF" in data:
        found, unit = _numbers(path, data, "uBRDF", len(f_r)), _unit(data, "uBRDF")
    elif isinstance(fixed := data["BRDF"].get("uncertainty"), dict):
        value, unit = fixed.get("value"), str(fixed.get("unit", ""))
        if not isinstance(value, int | float) or not 0.0 <= value <= _LARGEST:
            raise FormatError(f"{path}: data: BRDF: uncertainty: is no number from 0 up")
        found = np.full(len(f_r), float(value))
    else:
        return None
    if found.min() < 0.0:
        raise FormatError(f"{path}: data: uBRDF: is negative")
    return 0.01 * found * np.abs(f_r) if unit == "%" else found


def _arranged(
    path: PathLike,
    directions: _Array,
    f_r: _Array,
    wavelengths: _Array | None,
    polarized: _Array,
    sigma: _Array | None,
) -> tuple[_Array, _Array, _Array | None, _Array | None, int]:
    """Pairs of directions (n, 4), their values (n, bands), bands, mean uncertainties (n,), and how
    many pairs had one linear polarization only.
    """
    keys = np.round(directions * 1e9).astype(np.int64)
    _, first, pair = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    pair = np.argsort(np.argsort(first))[pair.reshape(-1)]
    first = np.sort(first)
    if wavelengths is None:
        bands, band = None, np.zeros(len(f_r), np.int64)
    else:
        bands, band = np.unique(wavelengths, return_inverse=True)
    width = 1 if bands is None else len(bands)
    if len(first) * width > 64 * max(len(f_r), 1024):
        raise FormatError(f"{path}: data: {len(first)} pairs of directions lack most of the bands")
    totals, counts = np.zeros((2, len(first), width)), np.zeros((2, len(first), width))
    spread = np.zeros((len(first), width))
    for side, chosen in enumerate((polarized >= 0.0, polarized <= 0.0)):
        np.add.at(totals[side], (pair[chosen], band[chosen]), f_r[chosen])
        np.add.at(counts[side], (pair[chosen], band[chosen]), 1.0)
    if not (counts.sum(axis=0) > 0.0).all():
        lacking = int((counts.sum(axis=0) == 0.0).any(axis=1).sum())
        raise FormatError(
            f"{path}: data: {lacking} of {len(first)} pairs of directions lack some of the "
            f"{width} wavelengths; write these to another file"
        )
    means = totals / np.maximum(counts, 1.0)
    both = np.asarray((counts > 0.0).all(axis=0))
    values = np.where(both, 0.5 * (means[0] + means[1]), means.sum(axis=0))
    if sigma is not None:
        np.maximum.at(spread, (pair, band), sigma)
    noise = None if sigma is None else spread.max(axis=1)
    return directions[first], values, bands, noise, int(np.count_nonzero((~both).any(axis=1)))


def _apertures(path: PathLike, metadata: Mapping[str, Any]) -> _Array | None:
    """Half angles of source and detector in radians, (2,), from their solid angles."""
    instrument = metadata.get("instrumentation")
    found = np.zeros(2)
    for side, system in enumerate(("illumination_system", "detection_system")):
        entry = instrument.get(system) if isinstance(instrument, dict) else None
        angle = entry.get("solid_angle") if isinstance(entry, dict) else None
        if isinstance(angle, dict) and angle.get("unit") == "sr":
            value = angle.get("value")
            if not isinstance(value, int | float) or not 0.0 <= value < 2.0 * math.pi:
                where = f"{path}: metadata: {system}: solid_angle"
                raise FormatError(f"{where}: is no number from 0 to less than 2 pi")
            found[side] = half_angle(value)
    return found if found.any() else None


def _facts(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """What to show of the metadata: who measured what, when, with which apertures."""
    facts: dict[str, Any] = {}
    for name in ("timestamp", "method", "description"):
        if isinstance(metadata.get(name), str):
            facts[name] = printable(metadata[name][:300])
    for section, key, shown in (
        ("provenance", "organization", "measured by"),
        ("instrumentation", "name", "instrument"),
        ("license", "type", "license"),
        ("sample", "type", "sample"),
    ):
        entry = metadata.get(section)
        if isinstance(entry, dict) and isinstance(entry.get(key), str):
            facts[shown] = printable(entry[key][:300])
    for system, shown in (("illumination_system", "beam"), ("detection_system", "detector")):
        instrument = metadata.get("instrumentation")
        found = instrument.get(system) if isinstance(instrument, dict) else None
        opening = found.get("aperture") if isinstance(found, dict) else None
        size = opening.get("dimensions") if isinstance(opening, dict) else None
        wide = size.get("diameter") if isinstance(size, dict) else None
        if isinstance(wide, dict) and type(wide.get("value")) in (int, float):
            facts[f"{shown} aperture"] = printable(f"{wide['value']:g} {wide.get('unit', '')}"[:60])
    return facts


def save(brdf: Brdf, path: PathLike) -> None:
    """Write a universal BRDF file, whole or not at all; each wavelength of a pair is an entry.

    What was read is written back with all that its file held. Anything else has metadata that say
    that nacre computed the values; colors become spectra that have them. A FormatError says that
    the path cannot be written, or that `brdf` is not known anywhere.
    """
    if isinstance(brdf, BirdBrdf) and brdf.document is not None:
        write_encoded(path, _encoded, brdf.document)
        return
    try:
        scan = brdf if isinstance(brdf, ScatteredBrdf) else tabulate(brdf)
    except ValueError as error:
        raise FormatError(f"{path}: cannot be written: {error}") from error
    wi, wo = scan.samples.wi, scan.samples.wo
    wavelengths: Floats | None
    values: Floats
    if scan.spectra is not None and scan.wavelengths is not None:
        wavelengths, values = scan.wavelengths, scan.spectra
    elif np.ptp(scan.samples.rgb, axis=1).max() == 0.0:
        wavelengths, values = None, scan.samples.rgb[:, :1]
    else:
        wavelengths, values = spectral_bands(brdf), spectra_of(brdf, wi, wo)
    width = values.shape[1]
    angles = [np.degrees(angle) for w in (wi, wo) for angle in to_spherical(split(w))]
    data: dict[str, Any] = {}
    if wavelengths is not None:
        listed = np.tile(wavelengths, len(wi)).tolist()
        data["wavelength_i"] = {"unit": "nm", "values": listed}
    for name, angle in zip(_ANGLES, angles, strict=True):
        limit = 360.0 if name.startswith("phi") else 90.0
        turned = angle % 360.0 if name.startswith("phi") else angle
        exact = np.minimum(np.round(turned, 9), np.nextafter(limit, 0.0))
        data[name] = {"unit": "deg", "values": np.repeat(exact, width).tolist()}
    flat = np.clip(values, 0.0, _LARGEST).reshape(-1)
    data["BRDF"] = {"unit": "sr^-1", "values": [float(f"{value:.9g}") for value in flat]}
    if scan.samples.sigma is not None:
        spread = np.repeat(scan.samples.sigma, width)
        data["uBRDF"] = {"unit": "1/sr", "values": [float(f"{value:.6g}") for value in spread]}
    write_encoded(path, _encoded, {"metadata": _metadata(brdf, path), "data": data})


def _encoded(document: Mapping[str, Any]) -> bytes:
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


def _metadata(brdf: Brdf, path: PathLike) -> dict[str, Any]:
    """What the schemas demand; they want words also where nacre cannot know any."""
    name = printable(" ".join(brdf.name.split())) or Path(path).stem
    place = ("country", "city", "street", "building_nr", "postal_code")
    return {
        "schema": _SCHEMA,
        "id": f"urn:nacre:{'-'.join(name.split())[:100] or 'material'}",
        "type": "BRDF",
        "timestamp": _now(),
        "provenance": {
            "organization": _UNKNOWN,
            "location": dict.fromkeys(place, _UNKNOWN),
            "email": _UNKNOWN,
            "contact_person": _UNKNOWN,
            "comments": "Values that nacre computed from a material.",
        },
        "method": "simulation",
        "instrumentation": "NA",
        "software": {"name": "nacre", "version": version("nacre-materials")},
        "sample": {
            "name": name,
            "type": _UNKNOWN,
            "shape": _UNKNOWN,
            "dimensions": {},
            "properties_symmetry": "isotropic" if brdf.isotropic else "anisotropic",
            "zero_azimuth_location": "x axis",
        },
        "environment": "NA",
    }


def _now() -> str:
    """The time, or that of SOURCE_DATE_EPOCH, with which a file is the same at any time."""
    fixed = os.environ.get("SOURCE_DATE_EPOCH", "")
    moment = datetime.fromtimestamp(int(fixed), UTC) if fixed.isdecimal() else datetime.now(UTC)
    return moment.strftime("%Y-%m-%dT%H:%M:%S+00:00")


def _recognize(head: bytes) -> bool:
    text = head.lstrip()
    return text.startswith(b"{") and b'"metadata"' in text and b"brdf_json_schema" in text


FORMAT = Format(
    "universal BRDF file (BiRD)",
    (".bird.brdf", ".brdf"),
    _recognize,
    load,
    save,
    keeps_bands=lambda *_: True,
    keeps_uncertainty=True,
)
