"""KTX 2.0 files, field by field as the specification of Khronos lays them out."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from nacre.io.ktx2 import ktx2

FIELDS = (
    *("vkFormat", "typeSize", "pixelWidth", "pixelHeight", "pixelDepth"),
    *("layerCount", "faceCount", "levelCount", "supercompressionScheme"),
    *("dfdByteOffset", "dfdByteLength", "kvdByteOffset", "kvdByteLength"),
    *("sgdByteOffset", "sgdByteLength", "byteOffset", "byteLength", "uncompressedByteLength"),
)


def header(content: bytes) -> dict[str, int]:
    return dict(zip(FIELDS, struct.unpack_from("<13I5Q", content, 12), strict=True))


@pytest.mark.parametrize(
    ("shape", "vk_format", "layers"),
    [((2, 3, 1), 76, 0), ((2, 3, 4), 97, 0), ((5, 2, 3, 4), 97, 5), ((5, 2, 3, 1), 76, 5)],
)
def test_the_header_describes_the_pixels(shape, vk_format, layers):
    pixels = np.arange(np.prod(shape), dtype=np.float16).reshape(shape)
    content = ktx2(pixels)
    found = header(content)
    assert content[:12] == b"\xabKTX 20\xbb\r\n\x1a\n"
    assert found["vkFormat"] == vk_format
    assert found["typeSize"] == 2
    assert (found["pixelWidth"], found["pixelHeight"], found["pixelDepth"]) == (3, 2, 0)
    assert (found["layerCount"], found["faceCount"], found["levelCount"]) == (layers, 1, 1)
    assert found["supercompressionScheme"] == 0
    assert (found["sgdByteOffset"], found["sgdByteLength"]) == (0, 0)
    assert found["byteLength"] == found["uncompressedByteLength"] == pixels.nbytes
    assert found["byteOffset"] % (2 * shape[-1]) == found["byteOffset"] % 4 == 0
    assert content[found["byteOffset"] :] == pixels.astype("<f2").tobytes()
    assert found["dfdByteOffset"] == 104  # 12 + 68 of the header, 24 of one level
    assert found["kvdByteOffset"] == 104 + found["dfdByteLength"]
    between = content[found["kvdByteOffset"] + found["kvdByteLength"] : found["byteOffset"]]
    assert between == bytes(len(between))
    assert len(between) < 8


def test_the_format_of_data_is_linear_halves_of_the_channels():
    content = ktx2(np.zeros((1, 1, 4), np.float16))
    words = struct.unpack_from("<23I", content, header(content)["dfdByteOffset"])
    assert words[0] == header(content)["dfdByteLength"] == 4 * 23
    assert words[1:3] == (0, 2 | 88 << 16)  # Khronos' basic block, version 2, its bytes
    assert words[3:5] == (1 | 1 << 16, 0)  # RGBSDA, no primaries, linear; blocks of one texel
    assert words[5:7] == (8, 0)  # bytes of the one plane
    minus_one, one = struct.unpack("<2I", struct.pack("<2f", -1.0, 1.0))
    for index, channel in enumerate((0, 1, 2, 15)):
        sample = words[7 + 4 * index : 11 + 4 * index]
        assert sample == (16 * index | 15 << 16 | (channel | 0xC0) << 24, 0, minus_one, one)


def test_keys_are_sorted_texts_padded_to_whole_words():
    content = ktx2(np.zeros((1, 1, 1), np.float16))
    found = header(content)
    rest = content[found["kvdByteOffset"] :][: found["kvdByteLength"]]
    entries = []
    while rest:
        (length,) = struct.unpack_from("<I", rest)
        entries.append(rest[4 : 4 + length])
        whole = 4 + -(-length // 4) * 4
        assert rest[4 + length : whole] == bytes(whole - 4 - length)
        rest = rest[whole:]
    assert entries == [b"KTXorientation\0rd\0", b"KTXwriter\0nacre\0"]
