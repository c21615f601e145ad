"""Materials of the UTIA BRDF database as images of 288 x 288 pixels.

Row 48 i + j from the top holds the light at theta_i = 15 i and phi_i = 7.5 j degrees, column
48 k + l the view at theta_v = 15 k and phi_v = 7.5 l: the order of the raw files, see
:mod:`nacre.measured.utia`. That rows count from the top is how ALTA's plugin `utia`, after code by
Filip, reads `.exr` files with OpenEXR. Mitsuba decodes the pixels, once the header is found to
promise no more than such an image.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.color import srgb_to_linear
from nacre.files import (
    Format,
    FormatError,
    PathLike,
    atomic_path,
    first_bytes,
    read_bytes,
    require,
)
from nacre.measured.raw import check_finite
from nacre.measured.utia import tabulate
from nacre.measured.utia_table import SHAPE, UtiaBrdf

_EDGE = 288
_SIZE_LIMIT = 1 << 24
"""Bytes of a file: four times what an image of float32 takes without compression."""
_HEADER_LIMIT = 1 << 16
_EXR_MAGIC = b"\x76\x2f\x31\x01"
_EXR_LONG_NAMES = 0x400
"""The one flag of an image in scan lines that is not a plain one."""
_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_PNG_COLORS = {2: "RGB", 6: "RGBA"}


def load_exr(path: PathLike) -> UtiaBrdf:
    """Read an ``.exr`` image of linear values.

    Parameters
    ----------
    path
        File to read, of one part in scan lines with channels R, G, B; its name becomes the
        material's. Values are f_r in 1/sr; a pixel with a negative channel is not valid.

    Raises
    ------
    FormatError
        If the file cannot be read, is no such image, or a value is not finite.
    MissingExtraError
        If Mitsuba is not installed.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    try:
        width, height, channels = _exr_header(data[:_HEADER_LIMIT])
    except (struct.error, ValueError, LookupError) as error:
        raise FormatError(f"{path}: is not an OpenEXR image of one part in scan lines") from error
    _check_size(path, width, height)
    if channels - {"A"} != {"R", "G", "B"}:
        found = ", ".join(sorted(channels)) or "none"
        raise FormatError(f"{path}: has other channels than R, G, B: {found!a}")
    values = _pixels(path).astype(np.float32)
    check_finite(values, f"{path}: pixels", "download the file again")
    return _material(values, path)


def load_png(path: PathLike) -> UtiaBrdf:
    """Read a ``.png`` image: a preview, clipped and quantised.

    Parameters
    ----------
    path
        File to read, of 8 or 16 bits a channel; its name becomes the material's. Values follow the
        sRGB curve whatever the file says; the largest means f_r of 1/sr, or more.

    Raises
    ------
    FormatError
        If the file cannot be read or is no such image.
    MissingExtraError
        If Mitsuba is not installed.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    if len(data) < 26 or not data.startswith(_PNG_MAGIC) or data[12:16] != b"IHDR":
        raise FormatError(f"{path}: is not a PNG image")
    width, height, bits, color = struct.unpack_from(">2I2B", data, 16)
    _check_size(path, width, height)
    if color not in _PNG_COLORS or bits not in (8, 16):
        raise FormatError(f"{path}: is not of three colours with 8 or 16 bits; save it as RGB")
    pixels = _pixels(path, _critical_chunks(data, path))
    return _material(srgb_to_linear(pixels / (2.0**bits - 1.0)), path)


def save_exr(brdf: Brdf, path: PathLike) -> None:
    """Write an ``.exr`` image of float32 values, whole or not at all.

    A :class:`UtiaBrdf` is written as it is, invalid samples included. Anything else is tabulated
    first (see :func:`nacre.measured.utia.tabulate`).

    Raises
    ------
    FormatError
        If the path cannot be written.
    MissingExtraError
        If Mitsuba is not installed.
    """
    mi = require("mitsuba", "render")
    utia = brdf if isinstance(brdf, UtiaBrdf) else tabulate(brdf)
    image = np.moveaxis(utia.stored.reshape(3, _EDGE, _EDGE), 0, -1)
    stream = mi.MemoryStream()
    bitmap = mi.Bitmap(np.ascontiguousarray(image), mi.Bitmap.PixelFormat.RGB)
    bitmap.write(stream, mi.Bitmap.FileFormat.OpenEXR)
    with atomic_path(path) as temporary:
        temporary.write_bytes(stream.raw_buffer())


def _check_size(path: PathLike, width: int, height: int) -> None:
    if (width, height) != (_EDGE, _EDGE):
        raise FormatError(
            f"{path}: has {width} x {height} pixels; of images, only UTIA tables of "
            f"{_EDGE} x {_EDGE} are materials"
        )


def _is_exr_table(path: Path) -> bool:
    try:
        width, height, channels = _exr_header(first_bytes(path, _HEADER_LIMIT))
    except (struct.error, ValueError, LookupError):
        return False
    return (width, height, channels - {"A"}) == (_EDGE, _EDGE, {"R", "G", "B"})


def _is_png_table(path: Path) -> bool:
    return first_bytes(path)[12:24] == struct.pack(">4s2I", b"IHDR", _EDGE, _EDGE)


def _exr_header(data: bytes) -> tuple[int, int, set[str]]:
    """Width, height and names of the channels; errors of many kinds where the header is damaged."""
    (flags,) = struct.unpack_from("<I", data, 4)
    if not data.startswith(_EXR_MAGIC) or flags & ~_EXR_LONG_NAMES != 2:
        raise ValueError("not version 2 with one part in scan lines")
    attributes = dict(_exr_attributes(data))
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    channels, rest = set(), attributes["channels"]
    while rest.rstrip(b"\0"):
        name, _, rest = rest.partition(b"\0")
        channels.add(name.decode("latin-1"))
        rest = rest[16:]
    return right - left + 1, bottom - top + 1, channels


def _exr_attributes(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Names and values in the header, up to the empty name that ends it."""
    offset = 8
    while data[offset] != 0:
        name_end = data.index(b"\0", offset)
        type_end = data.index(b"\0", name_end + 1)
        (size,) = struct.unpack_from("<I", data, type_end + 1)
        start = type_end + 5
        yield data[offset:name_end].decode("latin-1"), data[start : start + size]
        offset = start + size


def _critical_chunks(data: bytes, path: PathLike) -> bytes:
    """A PNG image without texts and profiles, which can be a thousand times what they take."""
    kept, offset, kind = [_PNG_MAGIC], len(_PNG_MAGIC), b""
    while kind != b"IEND":
        kind = data[offset + 4 : offset + 8]
        end = offset + 12 + int.from_bytes(data[offset : offset + 4], "big")
        if end > len(data):
            raise FormatError(f"{path}: ends within its pixels; the file is cut short")
        if kind[:1].isupper():
            kept.append(data[offset:end])
        offset = end
    return b"".join(kept)


def _pixels(path: PathLike, whole: bytes | None = None) -> npt.NDArray[Any]:
    """Red, green and blue as stored, shape (288, 288, 3), of a file or of what stands for it.

    The latter must be whole: Mitsuba does not notice that a stream in memory ends.
    """
    mi = require("mitsuba", "render")
    source: Any = str(path)
    if whole is not None:
        source = mi.MemoryStream()
        source.write(whole)
        source.seek(0)
    try:
        pixels = np.array(mi.Bitmap(source))
    except (RuntimeError, ValueError, MemoryError) as error:
        reason = str(error).strip().rpartition("\n")[2].removeprefix(']". ')
        raise FormatError(f"{path}: cannot be decoded: {reason}") from error
    return pixels[..., :3]


def _material(values: npt.NDArray[Any], path: PathLike) -> UtiaBrdf:
    return UtiaBrdf(np.moveaxis(values, -1, 0).reshape(SHAPE), Path(path).stem)


FORMATS = (
    Format(
        "UTIA image (.exr)",
        (".exr",),
        lambda head: head.startswith(_EXR_MAGIC),
        load_exr,
        save_exr,
        claims=_is_exr_table,
    ),
    Format(
        "UTIA image (.png)",
        (".png",),
        lambda head: head.startswith(_PNG_MAGIC),
        load_png,
        claims=_is_png_table,
    ),
)
"""Entries of the registry of formats; other images are refused when they are read."""
