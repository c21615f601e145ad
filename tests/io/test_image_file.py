"""Headers of images against what Pillow and Mitsuba wrote, and what is none."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.io.image_file import HEADER_LIMIT, decode, read_header
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
        refused(path, "is not of three colors with 8 bits")
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
    with pytest.raises(FormatError, match="another size than its header"):
        decode(other, header, path)


def test_what_is_no_image_is_refused(tmp_path: Path) -> None:
    refused(tmp_path / "absent.png", "cannot be read")
    refused(tmp_path, "is a directory")
    os.mkfifo(tmp_path / "pipe.png")
    refused(tmp_path / "pipe.png", "is not a regular file")
    (tmp_path / "x.png").write_bytes(b"GIF89a")
    refused(tmp_path / "x.png", "is not an OpenEXR, PNG or JPEG image")


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cores cannot be left out here")
def test_openexr_images_are_written_and_read_on_one_core(tmp_path: Path) -> None:
    script = """
import os, sys
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import numpy as np
from pathlib import Path
from nacre.io.image_file import decode, read_header
from nacre.render.environment import load_environment
from nacre.render.preview import write_image
path = Path(sys.argv[1])
picture = np.full((4, 6, 3), 0.5)
write_image(picture, path)
assert (decode(path.read_bytes(), read_header(path), path) == picture).all()
assert load_environment(path).pixels.shape == picture.shape
"""
    command = [sys.executable, "-c", script, str(tmp_path / "x.exr")]
    subprocess.run(command, check=True, timeout=60)
