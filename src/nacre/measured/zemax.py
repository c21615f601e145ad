"""Zemax OpticStudio's tabular BSDF files.

Text: a header, and for each rotation of the sample and each incidence the total integrated scatter
and a table of f_r in 1/sr. Its rows are azimuths, its columns distances, both about the mirror
direction, in degrees; azimuth 0 points from it toward the normal and grows counter-clockwise, seen
from above. At rotation 0 the normal of the plane of incidence is the sample's +x axis. Rykowski and
Auriol, "Zemax Tabular BSDF data file format" (support.zemax.com, article 1500005486801).

OpticStudio scatters the share of light that the total integrated scatter says, whatever a table
sums to, and so does Ansys' own converter to Speos (ansys/optical-automation): so are tables read.
"""

from __future__ import annotations

import re
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
from nacre.measured.specular_nodes import ROTATIONS, Resolution, growing, scaled_note
from nacre.measured.words import Words
from nacre.sampling import check_isotropic

_SIZE_LIMIT = 1 << 28
_LARGEST = float(np.finfo(np.float32).max)
_CHANNELS = {"monochrome": ("monochrome",), "xyz": ("tristimulusx", "tristimulusy", "tristimulusz")}
_HEADER = ("source", "symmetry", "spectralcontent", "scattertype")
_LISTS = ("samplerotation", "angleofincidence", "scatterazimuth", "scatterradial")
_WRITTEN = ("SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial")
_SYMMETRIES = {"planesymmetrical": 180.0, "asymmetrical": 360.0, "asymmetrical4d": 360.0}
_COMMENT_LIMIT = 1000
_FINEST = np.radians(1.0)  # steps of the integral of a table
_WAVELENGTH = re.compile(r"wavelength[^=:\d]*[=:]?\s*(\d+(?:\.\d+)?)|(\d+(?:\.\d+)?)\s*nm\b", re.I)


@dataclass(frozen=True)
class _Nodes:
    rotations: Floats
    incidences: Floats
    azimuths: Floats
    radials: Floats

    def directions(self) -> tuple[Floats, Floats]:
        """Lights and views, shapes (rotations, incidences, 1, 1, 3) and (rotations, incidences,
        azimuths, radials, 3). Under one rotation the light comes from -x.
        """
        theta = self.incidences[:, None, None]
        mirror = np.stack([np.sin(theta), 0.0 * theta, np.cos(theta)], axis=-1)
        toward_normal = np.stack([-np.cos(theta), 0.0 * theta, np.sin(theta)], axis=-1)
        radial, azimuth = self.radials[:, None], self.azimuths[:, None, None]
        around = np.cos(azimuth) * toward_normal - np.sin(azimuth) * np.array([0.0, 1.0, 0.0])
        lights = mirror * [-1.0, 1.0, 1.0]
        views = np.cos(radial) * mirror + np.sin(radial) * around
        turns = 0.0 * self.rotations if self.isotropic else 0.5 * np.pi - self.rotations
        return _turned(lights, turns), _turned(views, turns)

    @property
    def isotropic(self) -> bool:
        return len(self.rotations) == 1

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(map(len, (self.rotations, self.incidences, self.azimuths, self.radials)))

    def reflected(self, values: Floats) -> Floats:
        """Share of the light that tables reflect, shape (rotations, incidences), from f_r in 1/sr
        of the shape of the nodes; bilinear between these, 0 beyond.
        """
        azimuths, across = _interpolation(self.azimuths)
        radials, along = _interpolation(self.radials)
        theta = self.incidences[:, None, None]
        height = np.cos(radials) * np.cos(theta)
        height = height + np.sin(radials) * np.sin(theta) * np.cos(azimuths)[:, None]
        weight = np.maximum(height, 0.0) * np.sin(radials)
        nodes = across.T @ weight @ along  # (incidences, azimuths, radials)
        half = 2.0 if self.azimuths[-1] < 1.01 * np.pi else 1.0
        return np.asarray(half * np.einsum("iar,tiar->ti", nodes, values))


def _turned(directions: Floats, turns: Floats) -> Floats:
    """Directions turned about the normal by each angle, which becomes the first axis."""
    turn = turns.reshape(-1, *[1] * (directions.ndim - 1))
    cosine, sine = np.cos(turn), np.sin(turn)
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, z + 0.0 * turn], axis=-1)


def _interpolation(nodes: Floats) -> tuple[Floats, Floats]:
    """Points (n,) in the middle of fine steps between increasing nodes (m,), and the matrix (n, m)
    that interpolates linearly at them, times the steps.
    """
    if len(nodes) < 2:
        return nodes, np.zeros((1, 1))
    steps = np.ceil(np.diff(nodes) / _FINEST).astype(int)
    parts = [
        low + (high - low) * (np.arange(count) + 0.5) / count
        for low, high, count in zip(nodes[:-1], nodes[1:], steps, strict=True)
    ]
    points = np.concatenate(parts)
    hats = np.stack([np.interp(points, nodes, row) for row in np.eye(len(nodes))], axis=1)
    return points, hats * np.repeat(np.diff(nodes) / steps, steps)[:, None]


def load(path: PathLike, as_stored: bool = False) -> ScatteredBrdf:
    """Read a ``.bsdf`` file; tables for several rotations of the sample make it anisotropic.

    Each table is scaled to the total integrated scatter that the file says, unless `as_stored`.
    Where comments name one wavelength, the values are those of that band. A FormatError says that
    the file cannot be read, holds transmission, or that its tables are not as the header says.
    """
    comments: list[str] = []
    words = Words(path, _lines(path, comments))
    header, nodes = _read_header(words)
    channels = _CHANNELS[header["spectralcontent"]]
    tables = [_read_channel(words, name, nodes) for name in channels]
    words.end()
    notes = []
    if as_stored:
        values = np.stack([table for _, table in tables], axis=-1)
    else:
        scaled = [_scaled(nodes, *table) for table in tables]
        values = np.stack([table for _, table in scaled], axis=-1)
        factors = np.concatenate([factor.reshape(-1) for factor, _ in scaled])
        notes = scaled_note(
            factors, "the total integrated scatter (TIS) in the file", "OpticStudio"
        )
    wi, wo = nodes.directions()
    if not nodes.isotropic and header["symmetry"] == "planesymmetrical":
        wi, wo, values = _with_other_side(nodes, values)
    lights, views = (w.reshape(-1, 3) for w in np.broadcast_arrays(wi, wo))
    flat = values.reshape(-1, len(channels))
    bands = _bands(comments) if len(channels) == 1 else None
    rgb = xyz_to_rgb(flat) if len(channels) == 3 else np.repeat(flat, 3, axis=-1)
    return from_measurement(
        np.array(lights),
        np.array(views),
        rgb if bands is None else None,
        Path(path).stem.removesuffix(".zemax"),
        where=f"{path}: tables",
        isotropic=nodes.isotropic,
        spectra=None if bands is None else flat,
        wavelengths=bands,
        notes=notes,
    )


def _with_other_side(nodes: _Nodes, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Directions and values on both sides of the plane of incidence, from those on one."""
    other = _Nodes(nodes.rotations, nodes.incidences, -nodes.azimuths, nodes.radials)
    sides = [np.broadcast_arrays(*side.directions()) for side in (nodes, other)]
    wi, wo = (np.stack(parts) for parts in zip(*sides, strict=True))
    return wi, wo, np.stack([values, values])


def _scaled(nodes: _Nodes, scatter: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Factors, shape (rotations, incidences), and the tables multiplied by them."""
    total = nodes.reflected(np.maximum(values, 0.0))
    factor = np.divide(
        scatter, total, out=np.ones_like(total), where=(total > 1e-30) & (scatter > 0)
    )
    bounded = np.where(factor * np.abs(values).max(axis=(2, 3)) <= _LARGEST, factor, 1.0)
    return bounded, values * bounded[:, :, None, None]


def _bands(comments: list[str]) -> Floats | None:
    """The one wavelength in nm that comments name, shape (1,); else None."""
    found = {
        float(match[1] or match[2])
        for line in comments
        for match in _WAVELENGTH.finditer(line)
        if 100.0 <= float(match[1] or match[2]) <= 100_000.0
    }
    return np.array([*found]) if len(found) == 1 else None


def _lines(path: PathLike, comments: list[str]) -> Iterator[tuple[int, str]]:
    """Lines that are no comments; the first of these are added to a list."""
    for number, line in read_lines(path, _SIZE_LIMIT):
        if not line.lstrip().startswith("#"):
            yield number, line
        elif len(comments) < _COMMENT_LIMIT:
            comments.append(line)


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
    angles = [np.radians(lists[name]) for name in _LISTS]
    return header, _Nodes(*angles)


def _check(words: Words, header: dict[str, str], lists: dict[str, Floats]) -> None:
    if header["scattertype"] != "brdf":
        found = header["scattertype"][:40]
        raise words.error(f"ScatterType: {found!r}; only reflection (BRDF) is read")
    for key, known in (("symmetry", _SYMMETRIES), ("spectralcontent", _CHANNELS)):
        if header[key] not in known:
            raise words.error(f"{key}: {header[key][:40]!r}, expected {', '.join(known)}")
    azimuths = _SYMMETRIES[header["symmetry"]]
    for key, limit in zip(_LISTS, (360.0, 90.0, azimuths, 180.0), strict=True):
        words.check_angles(lists[key], key, limit)


def _read_channel(words: Words, name: str, nodes: _Nodes) -> tuple[Floats, Floats]:
    """Total integrated scatter, (rotations, incidences), and f_r of the shape of the nodes."""
    words.expect(name)
    words.expect("DataBegin")
    shape = nodes.shape
    scatter, tables = [], []
    for _ in range(shape[0] * shape[1]):
        words.expect("TIS")
        scatter.append(words.number("a total integrated scatter"))
        tables.append(words.numbers(shape[2] * shape[3], "a table"))
    words.expect("DataEnd")
    return np.array(scatter).reshape(shape[:2]), np.array(tables).reshape(shape)


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write a Zemax tabular BSDF file, whole or not at all.

    It holds CIE XYZ under D65, or one table where the material is gray everywhere; where `brdf` is
    not known, `eval` counts. An anisotropic material has a table every 30 degrees of rotation. The
    total integrated scatter is what a table reflects, at most 1, as OpticStudio asks.
    """
    check_isotropic(brdf)
    resolution = resolution or Resolution()
    lights = resolution.lights()
    rotations = np.zeros(1) if brdf.isotropic else ROTATIONS
    azimuths = np.linspace(0.0, 180.0, resolution.azimuths)
    if not brdf.isotropic:
        azimuths = np.concatenate([azimuths, azimuths[1:] + 180.0])
    radials = growing(90.0 + lights[-1], resolution.polars)
    lists = rotations, lights, azimuths, radials
    nodes = _Nodes(*(np.radians(angles) for angles in lists))
    rgb = np.stack(
        [
            np.clip(np.nan_to_num(brdf.eval(wi, wo)), 0.0, _LARGEST / 2.0)
            for wi, wo in zip(*np.broadcast_arrays(*nodes.directions()), strict=True)
        ]
    )
    to_xyz = rgb_to_xyz_matrix(REC_709)
    gray = bool(np.ptp(rgb, axis=-1).max() <= 1e-6 * max(float(rgb.max()), 1e-30))
    content, matrix = ("Monochrome", to_xyz[1:2]) if gray else ("XYZ", to_xyz)
    lines = [
        f"# {printable(' '.join(brdf.name.split())) or 'material'}, tabulated by nacre",
        "Source  Measured",
        f"Symmetry  {'PlaneSymmetrical' if brdf.isotropic else 'Asymmetrical4D'}",
        f"SpectralContent  {content}",
        "ScatterType  BRDF",
        *(
            line
            for name, angles in zip(_WRITTEN, lists, strict=True)
            for line in (f"{name}  {len(angles)}", "\t".join(f"{x:.6g}" for x in angles))
        ),
    ]
    names = [content] if gray else [f"Tristimulus{axis}" for axis in "XYZ"]
    for name, weights in zip(names, matrix, strict=True):
        lines += ["", name, "DataBegin"]
        values = np.maximum(rgb @ weights, 0.0)
        total = np.minimum(nodes.reflected(values), 1.0).reshape(-1)
        for share, table in zip(total, values.reshape(-1, *values.shape[2:]), strict=True):
            lines.append(f"TIS {share:.6g}")
            lines += ["\t".join(f"{value:.4e}" for value in row) for row in table.tolist()]
        lines.append("DataEnd")
    write_encoded(path, str.encode, "\n".join([*lines, ""]))


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
    resolution=Resolution,
)
