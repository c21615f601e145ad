"""Folders of images: colors against Mitsuba's, directions from names, and what is bad."""

from __future__ import annotations

import shutil
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.measured.textures import UTIA, image_folder
from nacre.measured.textures.directions import from_degrees
from nacre.measured.textures.transposition import transposed
from nacre.measured.textures.ubo2014 import ColorModel, save
from nacre.measured.textures.utia_folder import load
from tests.cli.support import run
from tests.specimens.images import png_bytes
from tests.textures.support import HEIGHT, WIDTH, assert_refused, linear, pixels, write_image

mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")

RINGS = [(0, 0), *((15, 60 * k) for k in range(3))]


def name(light: tuple[int, int], view: tuple[int, int], ending: str = "png") -> str:
    tail = f"tl{light[0]:03}_pl{light[1]:03}_tv{view[0]:03}_pv{view[1]:03}.{ending}"
    return f"tv{view[0]:03}_pv{view[1]:03}/{tail}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Four views with four lights each, some of the views in folders of their own."""
    path = tmp_path / "cloth"
    path.mkdir()
    for i, view in enumerate(RINGS):
        for j, light in enumerate(RINGS):
            place = path / name(light, view)
            write_image(place if i % 2 else path / place.name, pixels(4 * i + j))
    (path / "tv999.txt").write_text("nothing")
    return path


def test_directions_come_from_names_and_colors_from_srgb(folder: Path) -> None:
    found = nacre.load(folder)
    assert (found.name, found.width, found.height, found.pair_count) == ("cloth", 7, 5, 16)
    expected = from_degrees(*np.array(RINGS).T)
    np.testing.assert_allclose(found.wi, np.tile(expected, (4, 1)), atol=1e-6)
    np.testing.assert_allclose(found.wo, np.repeat(expected, 4, axis=0), atol=1e-6)
    np.testing.assert_allclose(found.wi[:4], UTIA.directions[:4], atol=1e-6)
    pictures = found.images(slice(None))
    for index, picture in enumerate(pictures):
        np.testing.assert_allclose(picture, linear(pixels(index)), rtol=2e-5, atol=1e-7)
    assert found.describe()["values"] == "sRGB, 8 bits, RGB"


def test_texels_are_the_same_by_any_way(folder: Path, tmp_path: Path) -> None:
    found = nacre.load(folder)
    expected = np.moveaxis(found.images(slice(None)), 0, 2).reshape(WIDTH * HEIGHT, 16, 3)
    chosen = np.array([9, 30, 2])
    np.testing.assert_array_equal(found.texels(chosen), expected[chosen])
    np.testing.assert_array_equal(found.texels(slice(4, 8)), expected[4:8])
    with transposed(found, tmp_path, np.float32, size_limit=3 * 24 * WIDTH * HEIGHT) as turned:
        assert not turned.by_image
        assert len(turned._parts) == 6
        np.testing.assert_array_equal(turned.texels(chosen), expected[chosen])
        np.testing.assert_array_equal(turned.texels(slice(4, 8)), expected[4:8])
        np.testing.assert_array_equal(turned.images(chosen[1:] % 16), found.images(chosen[1:] % 16))
        with transposed(turned) as same:
            assert same is turned
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cloth"]


def test_a_conversion_reads_each_image_once(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Path] = []
    decode = image_folder.decode
    monkeypatch.setattr(image_folder, "decode", lambda *a: read.append(a[2]) or decode(*a))
    monkeypatch.setattr(image_folder, "_CACHE_SIZE", 0)
    found = nacre.load(folder)
    assert not read
    stages: list[tuple[str, int, int]] = []
    nacre.save(found, tmp_path / "x.npz", progress=lambda *a: stages.append(a[:3]))
    assert sorted(read) == sorted(found.files)
    assert stages == [("reading images", 16, 16), ("writing", 35, 35)]
    back = nacre.load(tmp_path / "x.npz")
    np.testing.assert_allclose(
        back.texels(slice(None)), found.texels(slice(None)), rtol=5e-4, atol=1e-7
    )


def test_the_last_images_are_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(image_folder, "_CACHE_SIZE", 2 * 12 * WIDTH * HEIGHT)
    found = nacre.load(folder)
    for index in (0, 1, 1, 0, 2, 0):
        found.images(np.array([index]))
    assert found._image.cache_info()[:2] == (3, 3)
    assert found._image.cache_info().currsize == 2


def test_images_of_xyz_become_rgb(tmp_path: Path) -> None:
    image = pixels(1, "f2")
    bitmap = mi.Bitmap(image, mi.Bitmap.PixelFormat.XYZ)
    bitmap.write(str(tmp_path / "tl000_pl000_tv015_pv060.exr"))
    found = load(tmp_path)
    expected = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    np.testing.assert_allclose(found.images([0])[0], np.array(expected), atol=2e-3)
    assert found.describe()["values"] == "linear, XYZ"


def test_images_of_radiance_have_the_cosine_taken_out(tmp_path: Path) -> None:
    image = pixels(2, "f4")
    write_image(tmp_path / "tl060_pl000_tv015_pv060.exr", image)
    np.testing.assert_array_equal(load(tmp_path).images([0])[0], image)
    found = nacre.load(tmp_path, quantity="radiance")
    np.testing.assert_allclose(found.images([0])[0], 2.0 * image, rtol=1e-6)
    assert found.describe()["images of radiance"] == 1


# What is bad


def test_folders_that_are_none_are_refused(tmp_path: Path) -> None:
    assert_refused(lambda: load(tmp_path), str(tmp_path), "has no image with a name like")
    assert_refused(lambda: nacre.load(tmp_path), str(tmp_path), "neither images named")
    assert_refused(lambda: load(tmp_path / "absent"), "absent: cannot be read")
    write_image(tmp_path / "tl٠٠٠_pl000_tv000_pv000.png", pixels(0))
    write_image(tmp_path / "tl00_pl000_tv000_pv000.png", pixels(0))
    assert_refused(lambda: load(tmp_path), "has no image with a name like")


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("tv000_pv000/tl000_pl000_tv015_pv000.png", "lies in the folder of another view"),
        ("tl015_pl060_tv015_pv000.png", "have the same light and view"),
        ("tl000_pl120_tv000_pv000.png", "have the same light and view"),
        ("tl095_pl000_tv000_pv000.png", "lights: tl095_pl000_tv000_pv000.png, "),
        ("tl000_pl000_tv090_pv000.png", "is not above the horizon"),
    ],
)
def test_names_that_contradict_are_refused(folder: Path, file: str, words: str) -> None:
    write_image(folder / file, pixels(0))
    assert_refused(lambda: load(folder), words)


def test_images_of_another_kind_are_refused(folder: Path) -> None:
    path = folder / name((15, 60), (15, 0))
    for content, words in (
        (b"", "is not an OpenEXR, PNG or JPEG image"),
        (png_bytes(np.zeros((6, 7, 3), np.uint8), 7, 6), "7 x 6 pixels"),
        (png_bytes(np.zeros((5, 7, 1), np.uint8), 7, 5), "does not have three colors"),
    ):
        path.write_bytes(content)
        assert_refused(lambda: load(folder), str(path), words)
    mi.Bitmap(np.ones((HEIGHT, WIDTH, 1), np.float32)).write(str(path.with_suffix(".exr")))
    path.unlink()
    assert_refused(lambda: load(folder), "has other channels than R, G, B or X, Y, Z: 'Y'")


def test_links_that_go_in_circles_are_refused(folder: Path) -> None:
    path = folder / name((15, 60), (15, 0))
    path.unlink()
    path.symlink_to(path)
    assert_refused(lambda: load(folder), str(path), "cannot be read")
    path.unlink()
    loop = folder / "tv075_pv000"
    loop.symlink_to(loop)
    assert_refused(lambda: load(folder), "tv075_pv000", "cannot be read")
    loop.unlink()
    loop.symlink_to(folder)  # a folder within itself is not gone into
    assert_refused(lambda: load(folder), "lies in the folder of another view")


def test_sizes_that_are_claimed_are_refused_in_little_memory(folder: Path, tmp_path: Path) -> None:
    bomb = png_bytes(np.zeros((4, 4, 3), np.uint8), 60_000, 60_000)
    for path in folder.rglob("tl*.png"):
        path.write_bytes(bomb)
    exr = write_image(tmp_path / "x" / "tl000_pl000_tv000_pv000.exr", pixels(0, "f4"))
    data = bytearray(exr.read_bytes())
    window = data.index(b"dataWindow\0box2i\0") + 21
    struct.pack_into("<4i", data, window, 9, 9, 0, 0)
    exr.write_bytes(data)
    assert_refused(lambda: load(exr.parent), "-8 x -8 pixels")
    struct.pack_into("<4i", data, window, 0, 0, 59_999, 59_999)
    exr.write_bytes(data)
    tracemalloc.start()
    try:
        for place in (folder, exr.parent):
            assert_refused(lambda place=place: load(place), "60000 x 60000 pixels", "scale them")
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_damaged_pixels_are_refused_when_they_are_used(folder: Path) -> None:
    path = folder / name((15, 60), (15, 0))
    path.write_bytes(path.read_bytes()[:-30])
    found = load(folder)
    index = found.files.index(path)
    assert_refused(lambda: found.images([index]), str(path), "cut short")
    assert_refused(lambda: found.texels(slice(0, 1)), str(path))
    path.unlink()
    assert_refused(lambda: found.images([index]), str(path), "no such file")
    shutil.copy(found.files[0], path)
    write_image(path, np.zeros((HEIGHT, WIDTH + 1, 3), np.uint8))
    assert_refused(lambda: found.images([index]), str(path), "all must be of one size")


@pytest.mark.parametrize("bits", [0x7FC00000, 0x7FA00000, 0x7F800000], ids=["nan", "snan", "inf"])
def test_pixels_that_are_not_finite_are_refused(tmp_path: Path, bits: int) -> None:
    image = pixels(3, "f4")
    image.view("u4")[1, 1, 1] = bits
    path = write_image(tmp_path / "tl000_pl000_tv000_pv000.exr", image)
    assert_refused(lambda: load(tmp_path).images([0]), str(path), "some are not finite")
    assert_refused(lambda: nacre.save(load(tmp_path), tmp_path / "x.npz"), "some are not finite")
    assert list(tmp_path.iterdir()) == [path]


def test_a_temporary_file_that_cannot_be_written_is_refused(folder: Path, tmp_path: Path) -> None:
    """On a full disk: at once, or not before the last bytes leave the buffer."""
    from tests.test_writing import full_disk

    found = load(folder)
    found.images(slice(None))
    bytes_of_all = 6 * WIDTH * HEIGHT * 16
    for size, step in ((100, bytes_of_all), (100, 1), (bytes_of_all - 1, 1)):
        with full_disk(size):
            assert_refused(
                lambda step=step: transposed(found, tmp_path, size_limit=step).__enter__(),
                f"{tmp_path}: temporary file cannot be written: File too large",
            )
    with full_disk(100):
        assert_refused(lambda: nacre.save(found, tmp_path / "x.npz"), "cannot be written")
    absent = tmp_path / "absent"
    assert_refused(
        lambda: transposed(found, absent).__enter__(), f"{absent}: temporary", "No such file"
    )
    assert list(tmp_path.iterdir()) == [folder]


# Values beyond those of half floats


@pytest.fixture
def bright(tmp_path: Path) -> tuple[Path, npt.NDArray[np.float32]]:
    """A folder of two pictures, the second with highlights; and their texels."""
    path = tmp_path / "foil"
    images = [pixels(4, "f4"), pixels(5, "f4")]
    images[1][2, 3] = 1e5, 70_000.0, 9e4
    for theta, image in zip((0, 30), images, strict=True):
        write_image(path / f"tl{theta:03}_pl000_tv015_pv060.exr", image)
    return path, np.stack(images, axis=2).reshape(-1, 2, 3)


def test_images_that_need_single_precision_get_it(bright, tmp_path: Path) -> None:
    path, expected = bright
    with transposed(load(path), tmp_path, size_limit=1) as turned:
        np.testing.assert_array_equal(turned.texels(slice(None)), expected)
    stages: list[tuple[str, int, int]] = []
    nacre.save(load(path), tmp_path / "x.npz", progress=lambda *a: stages.append(a[:3]))
    back = nacre.load(tmp_path / "x.npz")
    assert back.describe()["values"] == "float32"
    np.testing.assert_array_equal(back.texels(slice(None)), expected)
    assert stages[-2:] == [("reading images", 2, 2), ("writing", 35, 35)]
    assert_refused(
        lambda: nacre.save(load(path), tmp_path / "y.npz", precision="half"),
        "some are too large for float16; ask for single precision",
    )
    assert sorted(p.name for p in tmp_path.iterdir()) == ["foil", "x.npz"]


def test_a_factored_file_of_images_is_as_exact_as_its_numbers(bright, tmp_path: Path) -> None:
    path, expected = bright
    error = save(load(path), tmp_path / "x.btf", 2, ColorModel.LOG_RGB, 8).error
    found = nacre.load(tmp_path / "x.btf").texels(slice(None))
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=1e-5)
    assert error < 1e-5
    nacre.save(load(path), tmp_path / "half.btf")


def test_commands_take_such_images(bright, tmp_path: Path, monkeypatch) -> None:
    path, _ = bright
    monkeypatch.chdir(tmp_path)
    model = tmp_path / "foil.safetensors"
    assert run("convert", path, "-o", tmp_path / "x.npz") == 0
    assert run("compare", path, tmp_path / "x.npz") == 0
    assert run("fit", path, "-o", model) == 0
