"""Textures of half floats in KTX 2.0 files (Khronos, "KTX File Format Specification", 2.0.4)."""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
_VK_FORMATS = {1: 76, 4: 97}  # VK_FORMAT_R16_SFLOAT, VK_FORMAT_R16G16B16A16_SFLOAT
_CHANNELS = 0, 1, 2, 15  # red, green, blue, alpha of the color model RGBSDA
_SIGNED_FLOAT = 0xC0
_PLUS_ONE, _MINUS_ONE = struct.unpack("<2I", struct.pack("<2f", 1.0, -1.0))
_START = 80  # of the index of levels
_ENTRIES = {"KTXorientation": "rd", "KTXwriter": "nacre"}


def ktx2(pixels: npt.NDArray[np.float16]) -> bytes:
    """The content of a file with one level, uncompressed, first row at the top.

    Pixels are float16 numbers, not colors, with 1 or 4 channels: a picture, shape (height, width,
    channels), or a texture array, shape (layers, height, width, channels).
    """
    *layers, height, width, channels = pixels.shape
    data = np.ascontiguousarray(pixels, "<f2").tobytes()
    descriptor = _descriptor(channels)
    entries = b"".join(_entry(key, value) for key, value in _ENTRIES.items())
    descriptor_at = _START + 24
    entries_at = descriptor_at + len(descriptor)
    end = entries_at + len(entries)
    start = -(-end // 8) * 8  # a multiple of 4 and of the bytes of a pixel
    shape = width, height, 0, *(layers or (0,)), 1, 1
    header = struct.pack("<9I", _VK_FORMATS[channels], 2, *shape, 0)
    header += struct.pack("<4I2Q", descriptor_at, len(descriptor), entries_at, len(entries), 0, 0)
    header += struct.pack("<3Q", start, len(data), len(data))
    return b"".join([IDENTIFIER, header, descriptor, entries, bytes(start - end), data])


def _descriptor(channels: int) -> bytes:
    """What a pixel is made of (Khronos Data Format Specification 1.3, basic descriptor block)."""
    size = 24 + 16 * channels
    block = struct.pack("<I2H", 0, 2, size)
    block += bytes([1, 0, 1, 0, 0, 0, 0, 0, 2 * channels, *bytes(7)])
    for index, channel in enumerate(_CHANNELS[:channels]):
        block += struct.pack("<H2B", 16 * index, 15, _SIGNED_FLOAT | channel)
        block += struct.pack("<3I", 0, _MINUS_ONE, _PLUS_ONE)
    return struct.pack("<I", size + 4) + block


def _entry(key: str, value: str) -> bytes:
    text = f"{key}\0{value}\0".encode()
    return struct.pack("<I", len(text)) + text + bytes(-len(text) % 4)
