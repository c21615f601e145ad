"""Surface scattering distribution data (SSDD), libbsdf's own format.

A header and blocks of data, whose metadata are text and whose tables are text or binary. A table
of a BRDF is over the polar angles and azimuths of light and viewer, of the light and of directions
about the mirror direction, or of the half and difference vectors, in degrees. "Surface scattering
distribution data (SSDD) file format", version 0.2 (github.com/KimuraRyo/libbsdf, doc).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import xyz_to_rgb
from nacre.errors import CUT_SHORT, FormatError, in_words, printable
from nacre.geometry import from_rusinkiewicz_angles, from_spherical, join
from nacre.io.files import PathLike, atomic_path, read_bytes
from nacre.io.format import Format
from nacre.io.text_file import parse_numbers
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.specular_nodes import Resolution, bands, growing, spectra
from nacre.sampling import check_isotropic

_SIZE_LIMIT = 1 << 28
_VERSION = "0.2"
_LARGEST = float(np.finfo(np.float32).max)
_MOST_NODES = 4096
_CHANNELS = {"monochrome": 1, "rgb": 3, "xyz": 3}
_SPHERICAL, _SPECULAR, _HALF = (
    "spherical_coordinate_system",
    "specular_coordinate_system",
    "half_difference_coordinate_system",
)


@dataclass
class _Block:
    """Metadata of a table, and its values, shape (samples, channels)."""

    entries: dict[str, str]
    lists: list[Floats]
    values: Floats


def load(path: PathLike) -> ScatteredBrdf:
    """Read the BRDF in an ``.ssdd`` file; azimuths of the light make it anisotropic.

    Notes name the other blocks. A FormatError says that the file cannot be read, holds no BRDF, or
    which entry is wrong.
    """
    blocks = _blocks(path, read_bytes(path, _SIZE_LIMIT))
    used = next((b for b in blocks if b.entries["DATA_TYPE"] == "brdf"), None)
    if used is None:
        held = in_words(b.entries["DATA_TYPE"] for b in blocks)
        raise FormatError(f"{path}: holds no brdf, but {held[:120]}")
    wi, wo, values = _samples(path, used)
    model = used.entries.get("COLOR_MODEL", "monochrome")
    wavelengths = None
    if model == "spectrum":
        wavelengths = _numbers(path, "WAVELENGTH_LIST", used.entries.get("WAVELENGTH_LIST", ""))
    if model == "xyz":
        values = xyz_to_rgb(values)
    elif model == "monochrome":
        values = np.repeat(values, 3, axis=1)
    others = [b.entries["DATA_TYPE"] for b in blocks if b is not used]
    kept = ("SOURCE_TYPE", "DEVICE", "CREATION_DATE", "MEASUREMENT_DATE")
    return from_measurement(
        wi,
        wo,
        None if model == "spectrum" else values,
        printable(used.entries.get("NAME", "")) or Path(path).stem,
        where=f"{path}: brdf",
        isotropic=len(used.lists[1]) <= 1,
        spectra=values if model == "spectrum" else None,
        wavelengths=wavelengths,
        facts={k.lower().replace("_", " "): used.entries[k] for k in kept if k in used.entries},
        notes=[f"The file also holds {in_words(others)}, which is left out."] if others else [],
    )


def _blocks(path: PathLike, data: bytes) -> list[_Block]:
    blocks: list[_Block] = []
    entries: dict[str, str] = {}
    place, first = 0, True
    while place < len(data):
        end = data.find(b"\n", place)
        end = len(data) if end < 0 else end
        line = data[place:end].decode("utf-8", "replace").strip().lstrip("\ufeff")
        place = end + 1
        if not line or line.startswith("#"):
            continue
        key, _, value = line.partition(" ")
        if first and key != "VERSION":
            raise FormatError(f"{path}: starts with {line[:40]!r}, expected VERSION")
        first = False
        if key == "DATA_TYPE":
            entries = {}
        if key != "DATA":
            entries[key] = value.split(" #")[0].strip()
            continue
        block, place = _block(path, entries, value.split()[0] if value.split() else "", data, place)
        blocks.append(block)
    if not blocks:
        raise FormatError(f"{path}: ends before its first table; {CUT_SHORT}")
    return blocks


def _block(
    path: PathLike, entries: dict[str, str], mode: str, data: bytes, place: int
) -> tuple[_Block, int]:
    """A block whose table begins at a place of the file, and where that ends."""
    kind = entries.get("DATA_TYPE", "")
    if not kind:
        raise FormatError(f"{path}: DATA before DATA_TYPE")
    model = entries.get("COLOR_MODEL", "")
    if model == "spectrum":
        channels = len(_numbers(path, "WAVELENGTH_LIST", entries.get("WAVELENGTH_LIST", "")))
    elif model in _CHANNELS:
        channels = _CHANNELS[model]
    else:
        known = ", ".join([*_CHANNELS, "spectrum"])
        raise FormatError(f"{path}: COLOR_MODEL: {model[:40]!r} is not one of {known}")
    lists = []
    for number in range(4):
        key = f"PARAM{number}_LIST"
        needed = number == 0 or (kind in ("brdf", "btdf") and number > 1)
        if key not in entries and needed:
            raise FormatError(f"{path}: {kind}: {key} is missing")
        nodes = _numbers(path, key, entries.get(key, "0"))
        if len(nodes) > _MOST_NODES or not (np.diff(nodes) > 0.0).all():
            raise FormatError(f"{path}: {key}: must be at most {_MOST_NODES} increasing angles")
        lists.append(nodes)
    count = math.prod(map(len, lists))
    if count * channels > len(data):
        raise FormatError(f"{path}: {kind}: {count * channels} values do not fit; {CUT_SHORT}")
    if mode == "binary":
        size = 4 * count * channels
        if size > len(data) - place:
            raise FormatError(f"{path}: {kind}: ends within its table; {CUT_SHORT}")
        values: Floats = np.frombuffer(data, "<f4", count * channels, place).astype(np.float64)
        place += size
    elif mode == "ascii":
        values, place = _ascii(path, kind, data, place, count * channels)
    else:
        raise FormatError(f"{path}: DATA: {mode[:40]!r}, expected ascii or binary")
    if not (np.abs(values) <= _LARGEST).all():
        raise FormatError(f"{path}: {kind}: a value is not finite")
    return _Block(dict(entries), lists, values.reshape(count, channels)), place


def _ascii(path: PathLike, kind: str, data: bytes, place: int, count: int) -> tuple[Floats, int]:
    found: list[float] = []
    while len(found) < count:
        end = data.find(b"\n", place)
        end = len(data) if end < 0 else end
        if place >= len(data):
            problem = f"{len(found)} of {count} values"
            raise FormatError(f"{path}: {kind}: has {problem}; {CUT_SHORT}")
        line = data[place:end].decode("utf-8", "replace").strip()
        place = end + 1
        if line.startswith("#"):
            continue
        found += parse_numbers(line.split(" #")[0].split(), f"{path}: {kind}")
    if len(found) > count:
        raise FormatError(f"{path}: {kind}: more than {count} values")
    return np.array(found), place


def _numbers(path: PathLike, key: str, text: str) -> Floats:
    found = np.array(parse_numbers(text.split(), f"{path}: {key}"))
    if not len(found):
        raise FormatError(f"{path}: {key}: is empty")
    return found


def _samples(path: PathLike, block: _Block) -> tuple[Floats, Floats, Floats]:
    """Directions to the light and to the viewer, and values; the first parameter is fastest."""
    reductions = block.entries.get("REDUCTION_TYPE", "").split()
    grid = np.meshgrid(*[np.radians(nodes) for nodes in block.lists[::-1]], indexing="ij")
    d, c, b, a = (angles.reshape(-1) for angles in grid)
    kind = block.entries.get("PARAM_TYPE", "")
    if kind == _SPHERICAL:
        wi, wo = join(from_spherical(a, b)), join(from_spherical(c, d))
    elif kind == _HALF:
        wi, wo = (join(w) for w in from_rusinkiewicz_angles(a, b, c, d))
    elif kind == _SPECULAR:
        offsets = np.zeros(len(block.lists[0]))
        if "PARAM4_LIST" in block.entries:
            offsets = np.radians(_numbers(path, "PARAM4_LIST", block.entries["PARAM4_LIST"]))
            if len(offsets) != len(block.lists[0]):
                raise FormatError(f"{path}: PARAM4_LIST: must be as long as PARAM0_LIST")
        wi, wo = _specular(a, b, c, d, np.tile(offsets, len(a) // len(offsets)))
    else:
        known = ", ".join((_SPHERICAL, _SPECULAR, _HALF))
        raise FormatError(f"{path}: PARAM_TYPE: {kind[:60]!r} is not one of {known}")
    values = block.values
    if "reciprocity" in reductions:  # phi_d and phi_d + 180 degrees are one pair
        wi, wo = np.concatenate([wi, wo]), np.concatenate([wo, wi])
        values = np.concatenate([values, values])
    if "bilateral_symmetry" in reductions and len(block.lists[1]) > 1:
        raise FormatError(f"{path}: REDUCTION_TYPE: bilateral_symmetry of an anisotropic BRDF")
    return wi, wo, values


def _specular(
    theta: Floats, phi: Floats, radial: Floats, turn: Floats, offset: Floats
) -> tuple[Floats, Floats]:
    """Light, and views at distances from the mirror direction; at azimuth 0 they lie away from the
    normal.
    """
    wi = join(from_spherical(theta, phi))
    x, y, z = from_spherical(radial, turn)
    tilt = theta + offset
    out = np.cos(tilt) * x + np.sin(tilt) * z
    up = np.cos(tilt) * z - np.sin(tilt) * x
    mirror = phi + np.pi
    view = [
        np.cos(mirror) * out - np.sin(mirror) * y,
        np.sin(mirror) * out + np.cos(mirror) * y,
        up,
    ]
    return wi, np.stack(view, axis=-1)


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write an SSDD file, whole or not at all: spectra where there are any, else RGB, about mirror
    directions; every 30 degrees of the light's azimuth if it is anisotropic.
    """
    check_isotropic(brdf)
    resolution = resolution or Resolution()
    lights = resolution.lights()
    radials = growing(180.0, resolution.polars)
    turns = np.linspace(0.0, 360.0, 2 * resolution.azimuths - 1)
    planes = np.zeros(1) if brdf.isotropic else np.arange(0.0, 361.0, 30.0)
    lists = [lights, planes, radials, turns]
    grid = np.meshgrid(*[np.radians(nodes) for nodes in lists[::-1]], indexing="ij")
    d, c, b, a = (angles.reshape(-1) for angles in grid)
    wi, wo = _specular(a, b, c, d, np.zeros(len(a)))
    lines = [
        f"VERSION {_VERSION}",
        "SOFTWARE nacre",
        "",
        "DATA_TYPE brdf",
        f"COLOR_MODEL {'spectrum' if brdf.wavelengths is not None else 'rgb'}",
    ]
    if brdf.wavelengths is not None:
        lines.append(f"WAVELENGTH_LIST {_row(bands(brdf))}")
        values = spectra(brdf, wi, wo)
    else:
        values = brdf.eval(wi, wo)
    values = np.clip(np.nan_to_num(values), 0.0, _LARGEST)
    lines.append(f"PARAM_TYPE {_SPECULAR}")
    for number, nodes in enumerate(lists):
        if number != 1 or not brdf.isotropic:
            lines.append(f"PARAM{number}_LIST {_row(nodes)}")
    name = printable(" ".join(brdf.name.split()))
    lines += [*([f"NAME {name}"] if name else []), "SOURCE_TYPE generated", "DATA ascii", ""]
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write("\n".join(lines))
        rows = (" ".join(f"{value:.6g}" for value in row) for row in values.tolist())
        file.writelines(f"{row}\n" for row in rows)


def _row(values: Floats) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _recognize(head: bytes) -> bool:
    return head.lstrip().startswith(b"VERSION ") and b"DATA_TYPE" in head


FORMAT = Format(
    "SSDD",
    (".ssdd",),
    _recognize,
    load,
    save,
    resolution=Resolution,
    keeps_bands=lambda *_: True,
)
