"""UTIA tables as images: layout, sRGB curve, and images that are none or damaged."""

from __future__ import annotations

import functools
import re
import struct
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.color import srgb_to_linear
from nacre.errors import FormatError, MissingExtraError
from nacre.measured import UtiaBrdf, utia, utia_image
from nacre.measured.utia import SHAPE
from tests.measured import support
from tests.specimens.images import png_bytes

from .support import write

mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")
EDGE = 288


def random_table(seed: int = 0) -> npt.NDArray[np.float32]:
    table = np.random.default_rng(seed).random(SHAPE, dtype=np.float32)
    table[:, 1, 2, 3, 4] = -1.0
    return table


@pytest.fixture(scope="module")
def exr(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("utia") / "cloth.exr"
    nacre.save(UtiaBrdf(random_table()), path)
    return path


def test_an_exr_image_comes_back_as_it_was(exr: Path, tmp_path: Path) -> None:
    brdf = nacre.load(exr)
    assert isinstance(brdf, UtiaBrdf)
    assert brdf.name == "cloth"
    np.testing.assert_array_equal(brdf.stored, random_table())
    nacre.save(brdf, tmp_path / "again.exr")
    assert (tmp_path / "again.exr").read_bytes() == exr.read_bytes()


def test_rows_are_lights_from_the_top_and_columns_views(exr: Path, tmp_path: Path) -> None:
    image = np.array(mi.Bitmap(str(exr)))
    raw = tmp_path / "cloth.bin"
    utia.save(nacre.load(exr), raw)
    channels = np.frombuffer(raw.read_bytes(), "<f8").reshape(3, EDGE, EDGE)
    np.testing.assert_array_equal(np.moveaxis(image, -1, 0), channels.astype(np.float32))
    light, view = np.radians([30.0, 45.0]), np.radians([60.0, 15.0])  # theta, phi
    wi, wo = (
        np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
        for t, p in (light, view)
    )
    pixel = image[2 * 48 + 6, 4 * 48 + 2]
    np.testing.assert_allclose(nacre.load(exr).eval(wi, wo), pixel, rtol=1e-4)


@pytest.mark.parametrize("kind", ["half", "alpha", "uint"])
def test_exr_images_of_other_pixel_types_are_read(tmp_path: Path, kind: str) -> None:
    image = np.random.default_rng(1).random((EDGE, EDGE, 4 if kind == "alpha" else 3)) * 4
    image = image.astype({"half": np.float16, "alpha": np.float32, "uint": np.uint32}[kind])
    path = tmp_path / "x.exr"
    mi.Bitmap(image).write(str(path))
    stored = nacre.load(path).stored.reshape(3, EDGE, EDGE)
    np.testing.assert_array_equal(np.moveaxis(stored, 0, -1), image[..., :3].astype(np.float32))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [3, 4])
def test_a_png_image_is_srgb(tmp_path: Path, kind: type, channels: int) -> None:
    largest = np.iinfo(kind).max
    rng = np.random.default_rng(2)
    image = rng.integers(0, largest, (EDGE, EDGE, channels), kind, endpoint=True)
    image[0, :3, 0] = 0, 1, largest
    brdf = nacre.load(write(tmp_path / "x.png", png_bytes(image)))
    assert isinstance(brdf, UtiaBrdf)
    bitmap = mi.Bitmap(np.ascontiguousarray(image[..., :3]))  # whose conversion is not ours
    bitmap.set_srgb_gamma(True)
    linear = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    stored = np.moveaxis(brdf.stored.reshape(3, EDGE, EDGE), 0, -1)
    np.testing.assert_allclose(stored, np.array(linear), rtol=2e-5, atol=1e-7)
    assert stored[0, 0, 0] == 0.0
    assert stored[0, 2, 0] == 1.0


def test_the_srgb_curve_of_the_standard() -> None:
    found = srgb_to_linear(np.array([0.0, 0.04045, 0.5, 1.0]))
    np.testing.assert_allclose(found, [0.0, 0.0031308, 0.2140411, 1.0], atol=1e-7)


# Images that are none


refused_exr = functools.partial(support.assert_refused, utia_image.load_exr)
refused_png = functools.partial(support.assert_refused, utia_image.load_png)


def test_other_sizes_are_refused_before_pixels_are_decoded(exr: Path, tmp_path: Path) -> None:
    data = bytearray(exr.read_bytes())
    window = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    struct.pack_into("<4i", data, window, 0, 0, 99_999, 99_999)
    bomb = png_bytes(np.zeros((4, 4, 3), np.uint8), 100_000, 100_000)
    tracemalloc.start()
    try:
        refused_exr(write(tmp_path / "x.exr", bytes(data)), "100000 x 100000 pixels", "288 x 288")
        refused_png(write(tmp_path / "x.png", bomb), "100000 x 100000 pixels", "288 x 288")
        assert tracemalloc.get_traced_memory()[1] < 4 * len(data)
    finally:
        tracemalloc.stop()


def test_other_kinds_of_exr_are_refused(exr: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.exr"
    data = exr.read_bytes()
    for flags in (0x202, 0x802, 0x1002, 3):  # tiles, deep, parts, version 3
        refused_exr(write(path, data[:4] + struct.pack("<I", flags) + data[8:]), "one part")
    mi.Bitmap(np.ones((EDGE, EDGE, 1), np.float32)).write(str(path))
    refused_exr(path, "other channels than R, G, B: 'Y'")
    image = np.ones((EDGE, EDGE, 3), np.float32)
    image[5, 5, 1] = np.inf
    mi.Bitmap(image).write(str(path))
    refused_exr(path, "pixels: some are not finite")


def test_other_kinds_of_png_are_refused(tmp_path: Path) -> None:
    grey = png_bytes(np.zeros((EDGE, EDGE, 1), np.uint8))
    refused_png(write(tmp_path / "x.png", grey), "does not have three colors")


def test_texts_in_a_png_image_are_not_unpacked(tmp_path: Path) -> None:
    image = np.random.default_rng(5).integers(0, 255, (EDGE, EDGE, 3), np.uint8)
    data = png_bytes(image)
    text = struct.pack(">I", 12) + b"zTXt" + b"damaged text" + bytes(4)
    plain = utia_image.load_png(write(tmp_path / "x.png", data))
    brdf = utia_image.load_png(write(tmp_path / "x.png", data[:33] + 1000 * text + data[33:]))
    np.testing.assert_array_equal(brdf.stored, plain.stored)


def test_images_cut_short_are_refused(exr: Path, tmp_path: Path) -> None:
    data = re.sub(rb"nacre [0-9a-f]{32}\n\Z", b"", exr.read_bytes())  # the mark behind the end
    for length in [*range(1, 500, 7), *range(500, len(data), 99_991), len(data) - 1]:
        refused_exr(write(tmp_path / "x.exr", data[:length]))
    data = png_bytes(np.random.default_rng(3).integers(0, 255, (EDGE, EDGE, 3), np.uint8))
    for length in [*range(1, 100, 3), *range(100, len(data) - 20, 49_999)]:
        refused_png(write(tmp_path / "x.png", data[:length]))
    refused_exr(tmp_path / "absent.exr", "no such file")
    refused_exr(write(tmp_path / "large.exr", bytes((1 << 24) + 1)), "more than")


def test_damaged_images_end_in_one_line_or_in_a_table(exr: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    for load, data in (
        (utia_image.load_exr, exr.read_bytes()),
        (utia_image.load_png, png_bytes(rng.integers(0, 255, (EDGE, EDGE, 3), np.uint8))),
    ):
        for trial in range(60):
            damaged = bytearray(data)
            for place in rng.integers(0, 450 if trial % 3 else len(data), 3):
                damaged[place] ^= 1 << int(rng.integers(8))
            path = write(tmp_path / "damaged", bytes(damaged))
            try:
                assert np.isfinite(load(path).stored).all()
            except FormatError as error:
                message = str(error)
            else:
                continue
            assert str(path) in message
            assert "\n" not in message


def test_a_missing_extra_is_named(exr: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(MissingExtraError, match=r"nacre-materials\[render\]"):
        nacre.load(exr)
