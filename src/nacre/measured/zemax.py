"""Zemax OpticStudio's tabular BSDF files.

Text: a header, and for each incidence the total integrated scatter and a table of f_r in 1/sr. Its
rows are azimuths, its columns distances, both about the mirror direction, in degrees; azimuth 0
points from it toward the normal. Rykowski and Auriol, "Zemax Tabular BSDF data file format"
(support.zemax.com, article 1500005486801).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import REC_709, rgb_to_xyz_matrix, xyz_to_rgb
from nacre.errors import printable
from nacre.io.files import PathLike, write_encoded
from nacre.io.format import Format
from nacre.io.text_file import read_lines
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.specular_nodes import Resolution, growing
from nacre.measured.words import Words
from nacre.sampling import check_isotropic
from nacre.sampling.energy import albedos

_SIZE_LIMIT = 1 << 28
_LARGEST = float(np.finfo(np.float32).max)
_CHANNELS = {"monochrome": ("monochrome",), "xyz": ("tristimulusx", "tristimulusy", "tristimulusz")}
_HEADER = ("source", "symmetry", "spectralcontent", "scattertype")
_LISTS = ("samplerotation", "angleofincidence", "scatterazimuth", "scatterradial")
_SYMMETRIES = {"planesymmetrical": 180.0, "asymmetrical": 360.0, "asymmetrical4d": 360.0}
_ORDER = 32  # of the integrals of albedos


@dataclass(frozen=True)
class _Nodes:
    incidences: Floats
    azimuths: Floats
    radials: Floats

    def directions(self) -> tuple[Floats, Floats]:
        """Lights and views, shapes (incidences, 1, 1, 3) and (incidences, azimuths, radials, 3)."""
        theta = self.incidences[:, None, None]
        mirror = np.stack([np.sin(theta), 0.0 * theta, np.cos(theta)], axis=-1)
        toward_normal = np.stack([-np.cos(theta), 0.0 * theta, np.sin(theta)], axis=-1)
        radial, azimuth = self.radials[:, None], self.azimuths[:, None, None]
        around = np.cos(azimuth) * toward_normal + np.sin(azimuth) * np.array([0.0, 1.0, 0.0])
        return mirror * [-1.0, 1.0, 1.0], np.cos(radial) * mirror + np.sin(radial) * around


def load(path: PathLike) -> ScatteredBrdf:
    """Read a ``.bsdf`` file of one sample rotation; what it says about total scatter is not needed.

    A FormatError says that the file cannot be read, holds transmission or several rotations of the
    sample, or that its tables are not as the header says.
    """
    words = Words(path, _lines(path))
    header, nodes = _read_header(words)
    channels = _CHANNELS[header["spectralcontent"]]
    values = np.stack([_read_channel(words, name, nodes) for name in channels], axis=-1)
    words.end()
    name = Path(path).stem.removesuffix(".zemax")
    wi, wo = nodes.directions()
    color = xyz_to_rgb(values) if len(channels) == 3 else np.repeat(values, 3, axis=-1)
    lights, views = (w.reshape(-1, 3) for w in np.broadcast_arrays(wi, wo))
    where = f"{path}: tables"
    return from_measurement(
        np.array(lights), np.array(views), color.reshape(-1, 3), name, where=where
    )


def _lines(path: PathLike) -> Iterator[tuple[int, str]]:
    lines = read_lines(path, _SIZE_LIMIT)
    return ((number, line) for number, line in lines if not line.lstrip().startswith("#"))


def _read_header(words: Words) -> tuple[dict[str, str], _Nodes]:
    header: dict[str, str] = {}
    lists: dict[str, Floats] = {}
    for expected in (*_HEADER, *_LISTS):
        words.expect(expected)
        if expected in _HEADER:
            header[expected] = words.take(expected)[1].lower()
        else:
            lists[expected] = words.numbers(words.count(expected), expected)
    _check(words, header, lists)
    angles = [np.radians(lists[name]) for name in _LISTS[1:]]
    return header, _Nodes(*angles)


def _check(words: Words, header: dict[str, str], lists: dict[str, Floats]) -> None:
    if header["scattertype"] != "brdf":
        found = header["scattertype"][:40]
        raise words.error(f"ScatterType: {found!r}; only reflection (BRDF) is read")
    for key, known in (("symmetry", _SYMMETRIES), ("spectralcontent", _CHANNELS)):
        if header[key] not in known:
            raise words.error(f"{key}: {header[key][:40]!r}, expected {', '.join(known)}")
    if len(lists["samplerotation"]) > 1:
        raise words.error("SampleRotation: several; only isotropic tables are read")
    limits = {"angleofincidence": 90.0, "scatterazimuth": _SYMMETRIES[header["symmetry"]]}
    for key in _LISTS[1:]:
        words.check_angles(lists[key], key, limits.get(key, 180.0))


def _read_channel(words: Words, name: str, nodes: _Nodes) -> Floats:
    """f_r, shape (incidences, azimuths, radials)."""
    words.expect(name)
    words.expect("DataBegin")
    shape = len(nodes.azimuths), len(nodes.radials)
    tables = []
    for _ in nodes.incidences:
        words.expect("TIS")
        words.number("a total integrated scatter")
        tables.append(words.numbers(shape[0] * shape[1], "a table").reshape(shape))
    words.expect("DataEnd")
    return np.array(tables)


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write a Zemax tabular BSDF file of an isotropic reflectance, whole or not at all.

    It holds CIE XYZ under D65, or one table where the material is gray everywhere; where `brdf` is
    not known, `eval` counts. The total integrated scatter is the albedo, at most 1, as OpticStudio
    asks.
    """
    check_isotropic(brdf)
    resolution = resolution or Resolution()
    lights = resolution.lights()
    azimuths = np.linspace(0.0, 180.0, resolution.azimuths)
    radials = growing(90.0 + lights[-1], resolution.polars)
    wi, wo = _Nodes(*(np.radians(nodes) for nodes in (lights, azimuths, radials))).directions()
    rgb = np.clip(np.nan_to_num(brdf.eval(*np.broadcast_arrays(wi, wo))), 0.0, _LARGEST / 2.0)
    theta = np.radians(lights)
    scatter = albedos(brdf, np.stack([theta, 0.0 * theta]), _ORDER)
    to_xyz = rgb_to_xyz_matrix(REC_709)
    gray = bool(np.ptp(rgb, axis=-1).max() <= 1e-6 * max(float(rgb.max()), 1e-30))
    content, matrix = ("Monochrome", to_xyz[1:2]) if gray else ("XYZ", to_xyz)
    lines = [
        f"# {printable(' '.join(brdf.name.split())) or 'material'}, tabulated by nacre",
        "Source  Measured",
        "Symmetry  PlaneSymmetrical",
        f"SpectralContent  {content}",
        "ScatterType  BRDF",
        *_listed("SampleRotation", np.zeros(1)),
        *_listed("AngleOfIncidence", lights),
        *_listed("ScatterAzimuth", azimuths),
        *_listed("ScatterRadial", radials),
    ]
    names = [content] if gray else [f"Tristimulus{axis}" for axis in "XYZ"]
    for name, weights in zip(names, matrix, strict=True):
        lines += ["", name, "DataBegin"]
        total = np.clip(scatter @ weights, 0.0, 1.0)
        for fraction, table in zip(total, np.maximum(rgb @ weights, 0.0), strict=True):
            lines.append(f"TIS {fraction:.6f}")
            lines += ["\t".join(f"{value:.4e}" for value in row) for row in table.tolist()]
        lines.append("DataEnd")
    write_encoded(path, str.encode, "\n".join([*lines, ""]))


def _listed(name: str, values: Floats) -> list[str]:
    return [f"{name}  {len(values)}", "\t".join(f"{value:.6g}" for value in values)]


def _recognize(head: bytes) -> bool:
    lines = [line.strip().lower() for line in head.splitlines()]
    first = next((line for line in lines if line and not line.startswith(b"#")), b"")
    return first.split()[:1] == [b"source"] and b"symmetry" in head.lower()


FORMAT = Format(
    "Zemax BSDF",
    (".zemax.bsdf", ".bsdf"),
    _recognize,
    load,
    save,
    isotropic=True,
    resolution=Resolution,
)
