"""Images, decoded only once their headers are found to promise no more than they may.

Mitsuba decodes OpenEXR and PNG, keeping 16 bits per channel; Pillow JPEG, as it notices that a file
ends too early, and parses its header. The headers of the other two are parsed here: Mitsuba cannot
read one without all pixels, and Pillow unpacks the compressed texts of a PNG image, which may be a
thousand times their packed size, and hides that samples have 16 bits.
"""

from __future__ import annotations

import io
import os
import struct
import sys
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import CUT_SHORT, FormatError, NacreError, reason, require
from nacre.io import radiance_image
from nacre.io.files import PathLike, opened, write_encoded
from nacre.io.memory import address_space

HEADER_LIMIT = 1 << 18  # bytes from the start of a file within which its size must be found

# Bytes of addresses that Mitsuba starts with: 323 MiB were seen, and each thread's stack.
_MITSUBA_SPACE = (400 + 8 * (os.cpu_count() or 1)) << 20

_USUAL_HEADER = 1 << 12  # bytes that nearly all headers fit in

EXR_MAGIC = b"\x76\x2f\x31\x01"
PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
JPEG_MAGIC = b"\xff\xd8\xff"

PIXEL_LIMIT = 1 << 26
"""Most pixels of an image that is read whole: what packs well could fill any memory."""

_EXR_HEADER_LIMIT = 1 << 16
_EXR_ROWS = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}
"""Rows of a block, by the kind of compression."""
_EXR_LONG_NAMES = 0x400  # the one flag of an image in scan lines that is not a plain one
_PNG_COLORS = {2, 6}  # RGB, with and without opacity


@dataclass(frozen=True)
class ImageHeader:
    """What an image promises."""

    width: int  # in pixels, as the height
    height: int
    channels: frozenset[str]  # names except opacity: R, G, B, or in an OpenEXR image any others
    bits: int  # of a sample that follows a display curve; 0 where values are linear


def read_header(path: PathLike) -> ImageHeader:
    """Header of an image of any of the kinds, recognized by its first bytes.

    Raises :class:`FormatError` if it cannot be read, is of no such kind, or does not have three
    colors.
    """
    with opened(path) as file:
        data = file.read(_USUAL_HEADER)
        try:
            return parse_header(data, path)
        except FormatError:
            return parse_header(data + file.read(HEADER_LIMIT - len(data)), path)


def parse_header(data: bytes, path: PathLike) -> ImageHeader:
    """As :func:`read_header`, from a file's first :data:`HEADER_LIMIT` bytes, or all it has."""
    kinds = {PNG_MAGIC: png_header, JPEG_MAGIC: _jpeg_header, EXR_MAGIC: exr_header}
    for magic, parse in kinds.items():
        if data.startswith(magic):
            return parse(data, path)
    raise FormatError(f"{path}: is not an OpenEXR, PNG or JPEG image")


def check_pixel_count(path: PathLike) -> None:
    """Refuse an image with more than :data:`PIXEL_LIMIT` pixels by its header, before it is
    decoded.

    A :class:`FormatError` says so, or that it cannot be read or is of no kind whose header is known
    here: OpenEXR, Radiance (`.hdr`), PNG or JPEG, with any channels.
    """
    with opened(path) as file:
        data = file.read(HEADER_LIMIT)
    try:
        count = _pixel_count(data)
    except (struct.error, ValueError, LookupError) as error:
        raise FormatError(f"{path}: is not an OpenEXR, Radiance, PNG or JPEG image") from error
    if count > PIXEL_LIMIT:
        raise FormatError(f"{path}: has more than {PIXEL_LIMIT:,} pixels; scale it down")


def _pixel_count(data: bytes) -> int:
    """Number of pixels that a header promises; raises what parsing it raises."""
    if data.startswith(PNG_MAGIC):
        width, height = struct.unpack_from(">2I", data, 16)
    elif data.startswith(EXR_MAGIC):
        places, _ = _exr_attributes(data[:_EXR_HEADER_LIMIT])
        left, top, right, bottom = _exr_window(data, places)
        width, height = right - left + 1, bottom - top + 1
    elif data.startswith(radiance_image.MAGIC):
        height, width, _, _ = radiance_image.parse_header(data)
    elif data.startswith(JPEG_MAGIC):
        width, height = _jpeg_size(data)
    else:
        raise ValueError("unknown")
    return int(width) * int(height)


def _jpeg_size(data: bytes) -> tuple[int, int]:
    """Width and height in the first frame header (ITU-T T.81, annex B.2.2)."""
    place = 2
    while True:
        marker, length = struct.unpack_from(">2H", data, place)
        if 0xFFC0 <= marker <= 0xFFCF and marker not in (0xFFC4, 0xFFC8, 0xFFCC):
            height, width = struct.unpack_from(">2H", data, place + 5)
            return width, height
        if marker < 0xFFC0:
            raise ValueError("no marker")
        place += 2 + length


def exr_header(data: bytes, path: PathLike) -> ImageHeader:
    try:
        (flags,) = struct.unpack_from("<I", data, 4)
        if not data.startswith(EXR_MAGIC) or flags & ~_EXR_LONG_NAMES != 2:
            raise ValueError("not version 2 with one part in scan lines")
        places, _ = _exr_attributes(data[:_EXR_HEADER_LIMIT])
        left, top, right, bottom = _exr_window(data, places)
        channels, rest = set(), data[places["channels"]]
        while rest.rstrip(b"\0"):
            name, _, rest = rest.partition(b"\0")
            channels.add(name.decode("latin-1"))
            rest = rest[16:]
    except (struct.error, ValueError, LookupError) as error:
        raise FormatError(f"{path}: is not an OpenEXR image of one part in scan lines") from error
    return ImageHeader(right - left + 1, bottom - top + 1, frozenset(channels - {"A"}), 0)


def png_header(data: bytes, path: PathLike) -> ImageHeader:
    if len(data) < 26 or not data.startswith(PNG_MAGIC) or data[12:16] != b"IHDR":
        raise FormatError(f"{path}: is not a PNG image")
    width, height, bits, color = struct.unpack_from(">2I2B", data, 16)
    if color not in _PNG_COLORS or bits not in (8, 16):
        raise FormatError(f"{path}: does not have three colors with 8 or 16 bits; save it as RGB")
    return ImageHeader(width, height, frozenset("RGB"), bits)


def decode(data: bytes, header: ImageHeader, path: PathLike) -> npt.NDArray[Any]:
    """Pixels of an image as stored, shape (height, width, 3).

    They are unsigned integers that follow a display curve, or linear values; red, green and blue,
    or the channels X, Y and Z. The header was found in the data, and promises no more than memory
    holds. OpenEXR images are decoded from the path.
    """
    decoder = _decode_by_pillow if data.startswith(JPEG_MAGIC) else _decode_by_mitsuba
    pixels = decoder(data, path)
    size = header.height, header.width
    if pixels.ndim != 3 or pixels.shape[:2] != size or pixels.shape[2] < 3:
        raise FormatError(f"{path}: does not have the size that its header says")
    return pixels[..., :3]


def _exr_attributes(data: bytes) -> tuple[dict[str, slice], int]:
    """Where the values of a header are, by name, and where the header ends."""
    places, offset = {}, 8
    while data[offset] != 0:
        name_end = data.index(b"\0", offset)
        type_end = data.index(b"\0", name_end + 1)
        (size,) = struct.unpack_from("<I", data, type_end + 1)
        start = type_end + 5
        places[data[offset:name_end].decode("latin-1")] = slice(start, start + size)
        offset = start + size
    return places, offset + 1


def _exr_window(data: bytes, places: Mapping[str, slice]) -> tuple[int, int, int, int]:
    """Left, top, right and bottom pixel according to a header."""
    left, top, right, bottom = struct.unpack("<4i", data[places["dataWindow"]])
    return left, top, right, bottom


def _exr_at_origin(data: bytes, path: PathLike) -> bytes | None:
    """An OpenEXR image whose pixels begin at (0, 0), where those in a file begin left of or above
    it.

    Renderings that are wider than their frame do. Mitsuba 3.9.1 then writes before its own pixels.
    None where they do not; a :class:`FormatError` says that such an image is damaged or in tiles.
    """
    try:
        places, start = _exr_attributes(data[:_EXR_HEADER_LIMIT])
        left, top, right, bottom = _exr_window(data, places)
        if min(left, top) >= 0:
            return None
        (flags,) = struct.unpack_from("<I", data, 4)
        if flags & ~_EXR_LONG_NAMES != 2:
            raise ValueError("not in scan lines")
        moved = bytearray(data)
        moved[places["dataWindow"]] = struct.pack("<4i", 0, 0, right - left, bottom - top)
        rows = _EXR_ROWS[data[places["compression"]][0]]
        for place in struct.unpack_from(f"<{-(-(bottom - top + 1) // rows)}Q", data, start):
            row, size = struct.unpack_from("<2i", data, place)
            if place < start or not 0 <= size <= len(data) - place - 8:
                raise ValueError("a block is not within the file")
            struct.pack_into("<i", moved, place, row - top)
    except (struct.error, ValueError, LookupError, OverflowError) as error:
        problem = "begins left of or above its frame, and is damaged or not in scan lines"
        raise FormatError(f"{path}: {problem}; crop it") from error
    return bytes(moved)


def _jpeg_header(data: bytes, path: PathLike) -> ImageHeader:
    from PIL import JpegImagePlugin

    try:
        with (
            warnings.catch_warnings(action="ignore"),
            JpegImagePlugin.JpegImageFile(io.BytesIO(data)) as image,
        ):
            (width, height), bits, mode = image.size, image.bits, image.mode
    except Exception as error:  # the parser meets damage in many ways
        raise FormatError(f"{path}: is not a whole JPEG image") from error
    if mode != "RGB" or bits != 8:
        raise FormatError(f"{path}: does not have three colors with 8 bits; save it as RGB")
    return ImageHeader(width, height, frozenset("RGB"), bits)


def _critical_chunks(data: bytes, path: PathLike) -> bytes:
    """A PNG image without texts and profiles, which can be a thousand times their packed size."""
    kept, offset, kind = [PNG_MAGIC], len(PNG_MAGIC), b""
    while kind != b"IEND":
        kind = data[offset + 4 : offset + 8]
        end = offset + 12 + int.from_bytes(data[offset : offset + 4], "big")
        if end > len(data):
            raise FormatError(f"{path}: ends within its pixels; {CUT_SHORT}")
        if kind[:1].isupper():
            kept.append(data[offset:end])
        offset = end
    return b"".join(kept)


def bitmaps() -> Any:
    """Mitsuba, with enough threads for its `Bitmap` to read and write OpenEXR images.

    Where it has only one thread, as on one core, that thread waits for another forever. Raises
    MissingExtraError if Mitsuba is not installed or does not load; NacreError if the process may
    not take as much memory as Mitsuba starts with: if half of it loaded, the process would stop, or
    wait forever.
    """
    left = address_space()
    if left is not None and left < _MITSUBA_SPACE and "mitsuba" not in sys.modules:
        raise NacreError("not enough memory to load mitsuba: raise ulimit -v")
    mi, drjit = require("mitsuba", "render"), require("drjit", "render")
    if drjit.thread_count() < 2:
        drjit.set_thread_count(2)
    return mi


def write_exr(bitmap: Any, path: PathLike) -> None:
    """Write Mitsuba's bitmap as an OpenEXR image, whole or not at all.

    Mitsuba encodes it in memory: its own writing of files gives no reason where one cannot be
    written. Raises FormatError as :func:`nacre.io.files.write_encoded`.
    """
    mi = bitmaps()
    stream = mi.MemoryStream()
    bitmap.write(stream, mi.Bitmap.FileFormat.OpenEXR)
    write_encoded(path, bytes, stream.raw_buffer())


def read_bitmap(path: PathLike) -> Any:
    """An image with any channels as Mitsuba's bitmap.

    Raises :class:`FormatError` as :func:`check_pixel_count`; a RuntimeError, ValueError or
    MemoryError if it cannot be decoded.
    """
    check_pixel_count(path)
    mi = bitmaps()
    with opened(path) as file:
        data = file.read()
    if not data.startswith(radiance_image.MAGIC):
        return mi.Bitmap(_source(data, path))
    header = radiance_image.parse_header(data)
    kind = mi.Bitmap.PixelFormat.XYZ if header.xyz else mi.Bitmap.PixelFormat.RGB
    return mi.Bitmap(radiance_image.decode(data, header), kind)


def _source(data: bytes, path: PathLike) -> Any:
    """What Mitsuba should decode: the file itself, or bytes where it would misread that."""
    changed = None
    if data.startswith(PNG_MAGIC):
        # It must be whole: Mitsuba does not notice where a stream in memory ends.
        changed = _critical_chunks(data, path)
    elif data.startswith(EXR_MAGIC):
        changed = _exr_at_origin(data, path)
    if changed is None:
        return str(path)
    source = bitmaps().MemoryStream()
    source.write(changed)
    source.seek(0)
    return source


def _decode_by_mitsuba(data: bytes, path: PathLike) -> npt.NDArray[Any]:
    mi = bitmaps()
    source = _source(data, path)
    try:
        return np.array(mi.Bitmap(source))
    except (RuntimeError, ValueError, MemoryError) as error:
        cause = str(error).strip().rpartition("\n")[2].removeprefix(']". ')
        raise FormatError(f"{path}: cannot be decoded: {cause}") from error


def _decode_by_pillow(data: bytes, path: PathLike) -> npt.NDArray[Any]:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=["JPEG"]) as image:
            return np.array(image)
    except Exception as error:  # the decoder meets damage in many ways
        raise FormatError(f"{path}: cannot be decoded: {reason(error)}") from error
