"""Headers of images against what Pillow and Mitsuba wrote, and what is none."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.io import image_file
from nacre.io.image_file import HEADER_LIMIT, PIXEL_LIMIT, check_pixel_count, decode, read_header
from nacre.mitsuba.environment import load_environment
from nacre.textures.height_file import read_heights
from tests.specimens.images import png_bytes

mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")
pillow = pytest.importorskip("PIL.Image", reason="needs the extra 'render'")
PIXELS = np.random.default_rng(0).integers(0, 256, (6, 9, 3), "u1")


def read(path: Path) -> np.ndarray:
    header = read_header(path)
    return decode(path.read_bytes(), header, path)


def refused(path: Path, words: str) -> None:
    with pytest.raises(FormatError, match=words) as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ending", ["png", "jpg", "exr"])
def test_headers_of_other_writers(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"x.{ending}"
    if ending == "exr":
        mi.Bitmap(PIXELS.astype(np.float16)).write(str(path))
    else:
        pillow.fromarray(PIXELS).save(path, quality=95)
    header = read_header(path)
    assert (header.width, header.height, header.channels) == (9, 6, set("RGB"))
    assert header.bits == (0 if ending == "exr" else 8)
    pixels = decode(path.read_bytes(), header, path)
    expected = np.array(pillow.open(path)) if ending == "jpg" else PIXELS
    np.testing.assert_array_equal(pixels, expected)


@pytest.mark.parametrize("options", [{"progressive": True}, {"exif": b"Exif\0\0" + bytes(60_000)}])
def test_sizes_of_jpeg_images_lie_behind_other_segments(tmp_path: Path, options: dict) -> None:
    path = tmp_path / "x.jpg"
    pillow.fromarray(PIXELS).save(path, **options)
    assert (read_header(path).width, read_header(path).height) == (9, 6)


def test_other_kinds_of_jpeg_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.jpg"
    for mode in ("L", "CMYK"):
        pillow.fromarray(PIXELS).convert(mode).save(path)
        refused(path, "does not have three colors with 8 bits")
    pillow.fromarray(PIXELS).save(path)
    data = path.read_bytes()
    for length in (3, 10, 200, len(data) // 2, len(data) - 20):
        path.write_bytes(data[:length])
        refused(path, r"not a whole JPEG|cannot be decoded")
    path.write_bytes(data[:4] + b"\0\0" * HEADER_LIMIT)
    refused(path, "not a whole JPEG")


def test_an_image_that_decodes_to_another_size_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.png"
    path.write_bytes(png_bytes(PIXELS, 9, 6))
    header = read_header(path)
    other = png_bytes(PIXELS[:, :8], 8, 6)
    with pytest.raises(FormatError, match="does not have the size that its header says"):
        decode(other, header, path)


def test_what_is_no_image_is_refused(tmp_path: Path) -> None:
    refused(tmp_path / "absent.png", "no such file")
    refused(tmp_path, "is a directory")
    os.mkfifo(tmp_path / "pipe.png")
    refused(tmp_path / "pipe.png", "is not a regular file")
    (tmp_path / "x.png").write_bytes(b"GIF89a")
    refused(tmp_path / "x.png", "is not an OpenEXR, PNG or JPEG image")


@pytest.mark.parametrize(
    ("ending", "channels"),
    [("png", 1), ("png", 3), ("jpg", 1), ("jpg", 3), ("exr", 1), ("exr", 3), ("hdr", 3)],
)
def test_images_of_few_pixels_pass(tmp_path: Path, ending: str, channels: int) -> None:
    path = tmp_path / f"x.{ending}"
    if ending in ("exr", "hdr"):
        mi.Bitmap(PIXELS[..., :channels].astype(np.float32)).write(str(path))
    else:
        pillow.fromarray(PIXELS if channels == 3 else PIXELS[..., 0]).save(path)
    check_pixel_count(path)


@pytest.mark.parametrize("ending", ["png", "jpg", "exr", "hdr"])
def test_images_of_many_pixels_are_refused_before_they_are_decoded(
    tmp_path: Path, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, edge = tmp_path / f"x.{ending}", 1 + int(PIXEL_LIMIT**0.5)
    if ending == "png":
        path.write_bytes(png_bytes(PIXELS, edge, edge))
    elif ending == "hdr":
        size = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n-Y 4 +X 4 \n\n-Y {edge} +X {edge}\n"
        path.write_bytes(size.encode() + bytes(64))
    else:
        write = {
            "jpg": pillow.fromarray(PIXELS).save,
            "exr": mi.Bitmap(PIXELS.astype(np.float32)).write,
        }
        write[ending](str(path))
        data = bytearray(path.read_bytes())
        if ending == "jpg":
            struct.pack_into(">2H", data, data.index(b"\xff\xc0") + 5, edge, edge)
        else:
            start = data.index(b"dataWindow\0box2i\0") + 21
            struct.pack_into("<4i", data, start, 0, 0, edge - 1, edge - 1)
        path.write_bytes(data)
    monkeypatch.setattr(mi, "Bitmap", lambda *_: pytest.fail("is decoded"))
    readers = [check_pixel_count, read_heights]
    readers += [load_environment] if ending != "jpg" else []
    for reader in readers:
        with pytest.raises(FormatError, match="more than 67,108,864 pixels"):
            reader(path)


def test_pixels_of_other_images_are_not_counted(tmp_path: Path) -> None:
    for data in (b"GIF89a", b"#?RADIANCE\n\n", b"\xff\xd8\xff\xe0", b"\x76\x2f\x31\x01"):
        (tmp_path / "x").write_bytes(data)
        with pytest.raises(FormatError, match="is not an OpenEXR, Radiance, PNG or JPEG image"):
            check_pixel_count(tmp_path / "x")


def moved(data: bytes, right: int, down: int) -> bytes:
    """An image of Mitsuba's, in blocks of 32 rows, whose pixels begin elsewhere."""
    out = bytearray(data)
    window = data.index(b"dataWindow\0box2i\0") + 21
    box = np.frombuffer(data, "<i4", 4, window)
    struct.pack_into("<4i", out, window, *np.add(box, (right, down, right, down)))
    first = data.index(b"screenWindowWidth\0float\0") + 33
    for place in np.frombuffer(data, "<u8", -(-int(box[3] + 1) // 32), first):
        (row,) = struct.unpack_from("<i", data, place)
        struct.pack_into("<i", out, place, row + down)
    return bytes(out)


@pytest.mark.parametrize("corner", [(-1, 0), (0, -7), (-50, -33), (4, 2)])
def test_openexr_images_may_begin_anywhere(tmp_path: Path, corner: tuple[int, int]) -> None:
    """Mitsuba alone ends the process where one begins left of or above its frame."""
    path, pixels = tmp_path / "x.exr", np.random.default_rng(1).random((70, 50, 3), np.float32)
    mi.Bitmap(pixels).write(str(path))
    path.write_bytes(moved(path.read_bytes(), *corner))
    np.testing.assert_array_equal(read(path), pixels)
    np.testing.assert_array_equal(load_environment(path).pixels, pixels)
    if min(corner) < 0:
        whole = path.read_bytes()
        for length in (len(whole) - 1, len(whole) // 2, 500):
            path.write_bytes(whole[:length])
            refused(path, "begins left of or above its frame, and is damaged")


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cores cannot be left out here")
def test_openexr_images_are_written_and_read_on_one_core(tmp_path: Path) -> None:
    script = """
import os, sys
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import numpy as np
from pathlib import Path
from nacre.io.image_file import decode, read_header
from nacre.mitsuba.environment import load_environment
from nacre.mitsuba.preview import write_image
path = Path(sys.argv[1])
picture = np.full((4, 6, 3), 0.5)
write_image(picture, path)
assert (decode(path.read_bytes(), read_header(path), path) == picture).all()
assert load_environment(path).pixels.shape == picture.shape
"""
    command = [sys.executable, "-c", script, str(tmp_path / "x.exr")]
    subprocess.run(command, check=True, timeout=60)


def test_too_little_memory_for_mitsuba_is_said_before_it_is_loaded(monkeypatch):
    monkeypatch.delitem(sys.modules, "mitsuba", raising=False)
    monkeypatch.setattr(image_file, "address_space", lambda: 1 << 20)
    with pytest.raises(NacreError, match="not enough memory to load mitsuba: raise ulimit -v"):
        image_file.bitmaps()
    monkeypatch.setitem(sys.modules, "mitsuba", sys)  # it is there already
    made = SimpleNamespace(thread_count=lambda: 2)
    monkeypatch.setattr(image_file, "require", lambda name, extra: made)
    assert image_file.bitmaps() is made
