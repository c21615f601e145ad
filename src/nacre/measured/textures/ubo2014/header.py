"""What stands before the matrices of a `.btf` file, and where in the file the matrices lie."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from mmap import mmap
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FormatError
from nacre.io.binary import BinaryReader
from nacre.io.files import PathLike
from nacre.measured.textures.directions import PAIR_LIMIT
from nacre.measured.textures.ubo2014.color_models import ColorModel, Decorrelation

MAGIC = b"!DFMF08FCR"  # first bytes of every file: decorrelated full matrix factorization
TEXEL_LIMIT = 1 << 26
COMPONENT_LIMIT = 1 << 12

CHANNELS = 3
_NEWEST = 4
_TEXT = 80
_XML_LIMIT = 1 << 24
_NAME_LIMIT = 80
_LARGEST = 1e6
_LOWEST = 0.5 * math.pi - 1e-6  # polar angle from which a direction counts as below the horizon
SCALARS: dict[int, np.dtype[Any]] = {size: np.dtype(f"<f{size}") for size in (2, 4, 8)}
"""Types of the numbers in matrices by their size in bytes."""
_LARGEST_FACTOR = 1e8

Angles = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Header:
    """All that a file says beside its matrices; bytes that are not UTF-8 are lone surrogates."""

    width: int
    height: int
    views: Angles  # polar angle and azimuth in radians, shape (views, 2)
    lights: Angles  # the same for the lights of each view, shape (views, lights, 2)
    colors: Decorrelation  # how the three channels that are factored become colors
    cosine: bool = False  # whether values were multiplied by the cosine of the light's polar angle
    setup: str = ""  # notes on the measurement, as sensor and light_source, at most 80 bytes each
    sensor: str = ""
    light_source: str = ""
    pixels_per_mm: float = 0.0  # texels per millimeter of the material; 0 where nobody knows
    rgb_scale: tuple[float, ...] = (1.0, 1.0, 1.0)  # in the file; no reader applies it
    xml: str = ""  # notes on the measurement, never parsed here
    channels: tuple[str, ...] = ("R", "G", "B")  # their names
    rotations: npt.NDArray[np.float32] = field(
        default_factory=lambda: np.zeros((0, 3, 3), np.float32)
    )  # matrices of local frames, shape (m, 3, 3); kept, but not applied

    @property
    def pair_count(self) -> int:
        return int(np.prod(self.lights.shape[:2]))


@dataclass(frozen=True)
class Factors:
    """Where the matrices U . SxV^T of one channel lie, row by row: singular values, U, then SxV."""

    scalar: np.dtype[Any]
    components: int
    rows: int
    columns: int
    start: int

    @property
    def u_start(self) -> int:
        return self.start + self.components * self.scalar.itemsize

    @property
    def sxv_start(self) -> int:
        return self.u_start + self.rows * self.components * self.scalar.itemsize

    @property
    def end(self) -> int:
        return self.sxv_start + self.columns * self.components * self.scalar.itemsize


def parse(data: bytes | mmap, path: PathLike) -> tuple[Header, tuple[Factors, ...]]:
    """Header and places of the matrices of each channel, checked against the file's length."""
    if data[: len(MAGIC)] != MAGIC:
        raise FormatError(f"{path}: does not start with {MAGIC.decode()}, not a factored Bonn BTF")
    reader = BinaryReader(data, path, len(MAGIC))
    notes = _notes(reader)
    views, lights = _directions(reader)
    width, height = reader.take("<2I", "the number of texels")
    if not 1 <= width * height <= TEXEL_LIMIT:
        raise FormatError(f"{path}: {width} x {height} texels, expected 1 to {TEXEL_LIMIT}")
    (count,) = reader.take("<I", "the number of rotations")
    start = reader.skip(36 * count, "the rotations")
    rotations = np.frombuffer(data, "<f4", 9 * count, start).reshape(count, 3, 3)
    _check_finite(path, "rotations", rotations)
    largest, model = reader.take("<Ii", "the number of components and the color model")
    matrix = reader.take("<12f", "the color mean and matrix")
    _check_finite(path, "color mean or matrix", matrix)
    if model not in ColorModel.__members__.values():
        known = ", ".join(str(int(m)) for m in ColorModel)
        raise FormatError(f"{path}: color model {model} is not read (those read: {known})")
    colors = Decorrelation(ColorModel(model), matrix[:3], np.reshape(matrix[3:], (3, 3)))
    header = Header(width, height, views, lights, colors, rotations=rotations, **notes)
    if not 1 <= largest <= COMPONENT_LIMIT:
        raise FormatError(f"{path}: {largest} components, expected 1 to {COMPONENT_LIMIT}")
    factors = tuple(_factors(reader, header, name, largest) for name in header.channels)
    if (end := reader.position) != len(data):
        raise FormatError(f"{path}: {len(data)} bytes, expected {end}; the file is damaged")
    return header, factors


def _notes(reader: BinaryReader) -> dict[str, Any]:
    """Facts about the measurement, which have a length of their own."""
    path, start = reader.path, reader.position
    size, version = reader.take("<2I", "the header's size and version")
    if not 1 <= version <= _NEWEST:
        raise FormatError(f"{path}: header of version {version}, expected 1 to {_NEWEST}")
    texts = [_text(reader.bytes(_TEXT, "the notes of the measurement")) for _ in range(3)]
    pixels_per_mm, *rgb_scale = reader.take("<4f", "pixels per mm and RGB scale")
    for what, values in (("pixels per mm", pixels_per_mm), ("RGB scale", rgb_scale)):
        _check_finite(path, what, values)
    (cosine,) = reader.take("<I", "the cosine flag") if version > 1 else (0,)
    if cosine > 1:
        raise FormatError(f"{path}: cosine flag {cosine}, expected 0 or 1")
    (length,) = reader.take("<I", "the length of the XML") if version > 2 else (0,)
    if length > _XML_LIMIT:
        raise FormatError(f"{path}: {length} bytes of XML, more than {_XML_LIMIT}")
    xml = _text(reader.bytes(length, "the XML"))
    names = ["R", "G", "B"]
    if version > 3:
        (count,) = reader.take("<I", "the number of channels")
        if count != CHANNELS:
            raise FormatError(f"{path}: {count} channels, expected 3; spectra are not read")
        names = [_name(reader) for _ in range(CHANNELS)]
    if (taken := reader.position - start) != size:
        raise FormatError(f"{path}: header size {size}, but its fields take {taken} bytes")
    return dict(zip(("setup", "sensor", "light_source"), texts, strict=True)) | {
        "pixels_per_mm": pixels_per_mm,
        "rgb_scale": tuple(rgb_scale),
        "cosine": bool(cosine),
        "xml": xml,
        "channels": tuple(names),
    }


def _name(reader: BinaryReader) -> str:
    (length,) = reader.take("<I", "the length of a channel's name")
    if length > _NAME_LIMIT:
        raise FormatError(f"{reader.path}: channel name of {length} bytes; the file is damaged")
    return _text(reader.bytes(length, "a channel's name"))


def _text(raw: bytes) -> str:
    """A text up to its end; bytes that are not UTF-8 come back from :func:`_bytes`."""
    return raw.partition(b"\0")[0].decode("utf-8", "surrogateescape")


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogateescape")


def _directions(reader: BinaryReader) -> tuple[Angles, Angles]:
    """Views, and the lights of each; every view has as many, else rows could not be numbered."""
    path, what = reader.path, "the directions"
    (count,) = reader.take("<I", "the number of views")
    start = reader.position
    _, _, lights = reader.take("<2fI", what)
    if not 1 <= count * lights <= PAIR_LIMIT:
        raise FormatError(f"{path}: {count} views of {lights} lights, expected 1 to {PAIR_LIMIT}")
    layout = np.dtype([("view", "<f4", 2), ("count", "<u4"), ("lights", "<f4", (lights, 2))])
    reader.position = start
    reader.skip(count * layout.itemsize, what)
    table = np.frombuffer(reader.data, layout, count, start)
    if (table["count"] != lights).any():
        raise FormatError(f"{path}: views differ in their number of lights, which is not read")
    views, angles = table["view"].copy(), table["lights"].copy()
    for name, values in (("view", views), ("light", angles)):
        _check_finite(path, f"angles of a {name}", values)
        low, high = values[..., 0].min(), values[..., 0].max()
        if low < 0.0 or high > _LOWEST:
            worst = np.degrees(high if high > _LOWEST else low)
            what = f"polar angle {worst:.6g} of a {name}"
            raise FormatError(f"{path}: {what}, expected 0 to below 90 degrees")
        if (np.abs(values) > _LARGEST).any():
            raise FormatError(f"{path}: azimuth of a {name} is too large")
    return views, angles


def _factors(reader: BinaryReader, header: Header, name: str, largest: int) -> Factors:
    """Numbers of rows and columns of the matrices of a channel; moves behind them."""
    where = f"{reader.path}: channel '{name}'"
    size, components, rows, columns = reader.take("<BIII", f"the matrix of channel '{name}'")
    if size not in SCALARS:
        raise FormatError(f"{where}: numbers of {size} bytes, expected 2, 4 or 8")
    pairs, texels = header.pair_count, header.width * header.height
    if (rows, columns) not in ((pairs, texels), (texels, pairs)):
        expected = f"{pairs} pairs x {texels} texels"
        raise FormatError(f"{where}: matrix of {rows} x {columns}, expected {expected}")
    most = min(rows, columns, largest)
    if not 1 <= components <= most:
        raise FormatError(f"{where}: {components} components, expected 1 to {most}")
    factors = Factors(SCALARS[size], components, rows, columns, reader.position)
    reader.skip(factors.end - factors.start, f"the matrices of channel '{name}'")
    return factors


def _check_finite(path: PathLike, what: str, values: npt.ArrayLike) -> None:
    if not np.isfinite(values).all() or np.abs(values).max(initial=0.0) > _LARGEST:
        raise FormatError(f"{path}: {what}: not finite or too large")


def largest(scalar: np.dtype[Any]) -> float:
    """Bound of the size of numbers in U and SxV, with which no value overflows."""
    return min(_LARGEST_FACTOR, float(np.finfo(scalar).max))


def pack(header: Header, components: int) -> bytes:
    """The bytes before the matrices, in the newest version, with so many components per channel."""
    notes = b"".join(
        _bytes(text)[:_TEXT].ljust(_TEXT, b"\0")
        for text in (header.setup, header.sensor, header.light_source)
    )
    notes += struct.pack("<4fI", header.pixels_per_mm, *header.rgb_scale, header.cosine)
    notes += _sized(header.xml) + struct.pack("<I", CHANNELS)
    notes += b"".join(map(_sized, header.channels))
    parts = [MAGIC, struct.pack("<2I", 8 + len(notes), _NEWEST), notes]
    parts.append(struct.pack("<I", len(header.views)))
    for view, lights in zip(header.views, header.lights, strict=True):
        parts += [struct.pack("<2fI", *view, len(lights)), lights.astype("<f4").tobytes()]
    parts.append(struct.pack("<3I", header.width, header.height, len(header.rotations)))
    parts.append(header.rotations.astype("<f4").tobytes())
    parts.append(struct.pack("<Ii", components, header.colors.model))
    parts.append(np.append(header.colors.mean, header.colors.matrix).astype("<f4").tobytes())
    return b"".join(parts)


def pack_factors(factors: Factors) -> bytes:
    """The bytes that stand right before :attr:`Factors.start`."""
    size = factors.scalar.itemsize
    return struct.pack("<BIII", size, factors.components, factors.rows, factors.columns)


def _sized(text: str) -> bytes:
    raw = _bytes(text)
    return struct.pack("<I", len(raw)) + raw
