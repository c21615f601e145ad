"""Radiance pictures (`.hdr`), decoded here: Mitsuba's decoder writes beyond its pixels.

It does where a row of runs is followed by one without (Mitsuba 3.9.1, `Bitmap::read_rgbe`). The
format is that of Ward, "Real Pixels" (Graphics Gems II, 1991), with the runs of Radiance 2.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Weights

MAGIC = b"#?"
_SIZE = re.compile(rb"-Y +(\d{1,9}) +\+X +(\d{1,9}) *\r?\n")
_FORMAT = b"FORMAT=32-bit_rle_"
_RUNS = range(8, 1 << 15)  # widths of rows that may be packed as runs


class Header(NamedTuple):
    """What a picture promises; `start` is where its pixels are, `xyz` whether they are CIE XYZ."""

    height: int
    width: int
    start: int
    xyz: bool


def parse_header(data: bytes) -> Header:
    """The header in the first bytes of a file; ValueError if it is none, or in another order."""
    text, blank, _ = data.partition(b"\n\n")
    if not blank:
        text, blank, _ = data.partition(b"\r\n\r\n")
    start = len(text) + len(blank)
    size = _SIZE.match(data, start)
    formats = {line.strip() for line in text.split(b"\n") if line.startswith(b"FORMAT=")}
    if not data.startswith(MAGIC) or not blank or size is None:
        raise ValueError("its header does not end in a size like -Y 512 +X 1024")
    if len(formats) != 1 or not formats <= {_FORMAT + b"rgbe", _FORMAT + b"xyze"}:
        raise ValueError("its format is not 32-bit_rle_rgbe or 32-bit_rle_xyze")
    return Header(int(size[1]), int(size[2]), size.end(), formats == {_FORMAT + b"xyze"})


def decode(data: bytes, header: Header) -> Weights:
    """Linear pixels of a whole file, shape (height, width, 3); ValueError if some are missing."""
    height, width, place, _ = header
    if place + 4 * height > len(data):
        raise ValueError("it ends within its pixels")
    if not _is_packed(data, place, width):
        if place + 4 * height * width > len(data):
            raise ValueError("it ends within its pixels")
        mantissas = np.frombuffer(data, np.uint8, 4 * height * width, place)
        return _linear(mantissas.reshape(height, width, 4))
    rows = np.empty((height, 4, width), np.uint8)
    for row in rows:
        if not _is_packed(data, place, width):
            raise ValueError("some of its rows are packed and some are not")
        place = _unpack(data, place + 4, row.reshape(-1), width)
    return _linear(rows.transpose(0, 2, 1))


def _is_packed(data: bytes, place: int, width: int) -> bool:
    start = data[place : place + 4]
    return width in _RUNS and start == b"\x02\x02" + width.to_bytes(2, "big")


def _unpack(data: bytes, place: int, row: npt.NDArray[np.uint8], width: int) -> int:
    """Fill in the four channels of a row, one after the other; returns where the next row is."""
    filled = 0
    while filled < row.size:
        count, packed = data[place] if place < len(data) else 0, False
        if count > 128:
            count, packed = count - 128, True
        left = width - filled % width
        part = data[place + 1 : place + 1 + (1 if packed else count)]
        if not 1 <= count <= left or len(part) != (1 if packed else count):
            raise ValueError("a row of its pixels is damaged or missing")
        row[filled : filled + count] = np.frombuffer(part, np.uint8)
        filled, place = filled + count, place + 1 + len(part)
    return place


def _linear(pixels: npt.NDArray[np.uint8]) -> Weights:
    """Values of three mantissas and an exponent; those without an exponent are 0."""
    exponents = pixels[..., 3:].astype(np.int32)
    scale = np.where(exponents > 0, np.ldexp(np.float32(1.0), exponents - 136), np.float32(0.0))
    return np.asarray(pixels[..., :3] * scale, np.float32)
