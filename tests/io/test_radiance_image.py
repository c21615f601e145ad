"""Radiance pictures: bit by bit what Mitsuba decodes, of files that it decodes safely."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.io.image_file import read_bitmap
from nacre.mitsuba.environment import load_environment
from nacre.textures.height_file import read_heights
from tests.variants import require_mitsuba

mi = require_mitsuba()

HEADER = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
PACKED = b"\2\2\0\x08" + b"\x88\x80" * 4
"""A row of 8 pixels."""


@pytest.mark.parametrize("size", [(4, 8), (5, 7), (3, 300)])
@pytest.mark.parametrize("kind", ["RGB", "XYZ"])
def test_pixels_are_those_of_mitsuba(tmp_path: Path, size: tuple[int, int], kind: str) -> None:
    random = np.random.default_rng(0)
    pixels = np.exp(4.0 * random.normal(size=(*size, 3))).astype(np.float32)
    pixels[:, : size[1] // 2] = 0.25  # which is packed
    pixels[0, 0] = 0.0
    path = tmp_path / "a.hdr"
    mi.Bitmap(pixels, getattr(mi.Bitmap.PixelFormat, kind)).write(str(path))
    ours, theirs = read_bitmap(path), mi.Bitmap(str(path))
    assert ours.pixel_format() == theirs.pixel_format()
    np.testing.assert_array_equal(np.array(ours), np.array(theirs))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (HEADER + b"-Y 2 +X 8\n" + PACKED + bytes(32), "some of its rows are packed"),
        (HEADER + b"-Y 2 +X 8\n" + PACKED, "some of its rows"),
        (HEADER + b"-Y 1 +X 8\n" + PACKED[:-1], "damaged or missing"),
        (HEADER + b"-Y 1 +X 8\n" + PACKED.replace(b"\x88", b"\x89", 1), "damaged or missing"),
        (HEADER + b"-Y 1 +X 8\n" + PACKED.replace(b"\x88", b"\x80", 1), "damaged or missing"),
        (HEADER + b"-Y 2 +X 3\n" + bytes(23), "ends within its pixels"),
        (HEADER + b"+Y 2 +X 8\n" + bytes(64), "is not an OpenEXR, Radiance"),
        (HEADER.replace(b"rgbe", b"none") + b"-Y 2 +X 8\n" + bytes(64), "is not an OpenEXR"),
    ],
)
def test_damage_is_refused(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "a.hdr"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=says):
        load_environment(path)
    with pytest.raises(FormatError, match=r"a\.hdr: "):
        read_heights(path)
