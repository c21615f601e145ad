"""Textures of half floats or bytes in KTX 2.0 files (Khronos, "KTX File Format Specification",
2.0.4).
"""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[np.float16] | npt.NDArray[np.uint8]

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
_VK_FORMATS = {
    (2, 1): 76,  # VK_FORMAT_R16_SFLOAT
    (2, 4): 97,  # VK_FORMAT_R16G16B16A16_SFLOAT
    (1, 4): 37,  # VK_FORMAT_R8G8B8A8_UNORM
}
_CHANNELS = 0, 1, 2, 15  # red, green, blue, alpha of the color model RGBSDA
_SIGNED_FLOAT = 0xC0
_PLUS_ONE, _MINUS_ONE = struct.unpack("<2I", struct.pack("<2f", 1.0, -1.0))
_START = 80  # of the index of levels
_ENTRIES = {"KTXorientation": "rd", "KTXwriter": "nacre"}


def ktx2(*levels: Pixels) -> bytes:
    """The content of a file, uncompressed, first row at the top.

    Levels are those of a picture, shape (height, width, channels), or of a texture array, shape
    (layers, height, width, channels), from the largest on. Pixels are numbers, not colors: float16
    with 1 or 4 channels, or uint8 with 4, which stand for 0 to 1.
    """
    *layers, height, width, channels = levels[0].shape
    size = levels[0].itemsize
    data = [np.ascontiguousarray(level, f"<{level.dtype.str[1:]}").tobytes() for level in levels]
    descriptor = _descriptor(channels, size)
    entries = b"".join(_entry(key, value) for key, value in _ENTRIES.items())
    descriptor_at = _START + 24 * len(levels)
    entries_at = descriptor_at + len(descriptor)
    end = entries_at + len(entries)
    start = -(-end // 8) * 8  # a multiple of 4 and of the bytes of a pixel
    shape = width, height, 0, *(layers or (0,)), 1, len(levels)
    header = struct.pack("<9I", _VK_FORMATS[size, channels], size, *shape, 0)
    header += struct.pack("<4I2Q", descriptor_at, len(descriptor), entries_at, len(entries), 0, 0)
    index = b""
    at = start + sum(map(len, data))
    for level in data:  # the index begins with the largest, the data with the smallest
        at -= len(level)
        index += struct.pack("<3Q", at, len(level), len(level))
    content = [IDENTIFIER, header, index, descriptor, entries, bytes(start - end)]
    return b"".join(content + data[::-1])


def _descriptor(channels: int, size: int) -> bytes:
    """What a pixel is made of (Khronos Data Format Specification 1.3, basic descriptor block)."""
    total = 24 + 16 * channels
    kind, least, most = (_SIGNED_FLOAT, _MINUS_ONE, _PLUS_ONE) if size == 2 else (0, 0, 255)
    block = struct.pack("<I2H", 0, 2, total)
    block += bytes([1, 0, 1, 0, 0, 0, 0, 0, size * channels, *bytes(7)])
    for index, channel in enumerate(_CHANNELS[:channels]):
        block += struct.pack("<H2B", 8 * size * index, 8 * size - 1, kind | channel)
        block += struct.pack("<3I", 0, least, most)
    return struct.pack("<I", total + 4) + block


def _entry(key: str, value: str) -> bytes:
    text = f"{key}\0{value}\0".encode()
    return struct.pack("<I", len(text)) + text + bytes(-len(text) % 4)
