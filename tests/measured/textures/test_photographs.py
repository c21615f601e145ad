"""Photographs with a list of directions: both ways to give them, units of pixels, bad lists."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.measured.textures import load_photographs
from nacre.measured.textures.directions import from_degrees
from tests.textures.support import HEIGHT, WIDTH, assert_refused, linear, pixels, write_image

pytest.importorskip("mitsuba", reason="needs the extra 'render'")
LIGHTS, VIEWS = ((0.0, 0.0), (60.0, 30.0)), ((45.0, 180.0), (12.5, 271.0))
ANGLES = """# made
theta_v,phi_v,file,theta_l,phi_l
45,180,a.png,0,0

12.5,271,more/b.exr,60,30
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "felt"
    path.mkdir()
    write_image(path / "a.png", pixels(0))
    write_image(path / "more" / "b.exr", pixels(1, "f4"))
    (path / "directions.csv").write_text(ANGLES)
    return path


def write_list(folder: Path, text: str) -> Path:
    path = folder / "directions.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_list_of_angles_in_the_folder(folder: Path) -> None:
    found = nacre.load(folder)
    assert (found.name, found.width, found.height, found.pair_count) == ("felt", WIDTH, HEIGHT, 2)
    np.testing.assert_allclose(found.wi, from_degrees(*np.array(LIGHTS).T), atol=1e-7)
    np.testing.assert_allclose(found.wo, from_degrees(*np.array(VIEWS).T), atol=1e-7)
    first, second = found.images(slice(None))
    np.testing.assert_allclose(first, linear(pixels(0)), rtol=2e-5, atol=1e-7)
    np.testing.assert_array_equal(second, pixels(1, "f4"))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_list_of_vectors_elsewhere(folder: Path, tmp_path: Path, separator: str) -> None:
    rows = [["file", "lx", "ly", "lz", "vx", "vy", "vz"]]
    for file, light, view in zip(("a.png", "more\\b.exr"), LIGHTS, VIEWS, strict=True):
        vectors = np.concatenate([from_degrees(*light), from_degrees(*view)])
        rows.append([f'"{file}"', *(f"{x:.4f}" for x in vectors)])
    path = tmp_path / "list.csv"
    path.write_text("\ufeff" + "".join(separator.join(row) + "\r\n" for row in rows), newline="")
    expected, found = nacre.load(folder), load_photographs(folder, path)
    np.testing.assert_allclose(found.wi, expected.wi, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(found.wo, axis=1), 1.0, atol=1e-6)
    np.testing.assert_array_equal(found.texels([3]), expected.texels([3]))
    path.rename(folder / "other.csv")
    np.testing.assert_array_equal(nacre.load(folder / "other.csv").wi, found.wi)


def test_radiance_by_an_option_or_by_a_column(folder: Path) -> None:
    plain = nacre.load(folder).images(slice(None))
    whole = nacre.load(folder, quantity="radiance").images(slice(None))
    np.testing.assert_allclose(whole[0], plain[0])
    np.testing.assert_allclose(whole[1], 2.0 * plain[1], rtol=1e-6)
    text = ANGLES.replace("phi_l\n", "phi_l,quantity\n").replace("0,0\n", "0,0,radiance\n")
    write_list(folder, text.replace("60,30\n", "60,30,reflectance\n"))
    np.testing.assert_array_equal(nacre.load(folder).images(slice(None)), plain)
    write_list(folder, text.replace("60,30\n", "60,30,radiance\n"))
    np.testing.assert_array_equal(nacre.load(folder).images(slice(None)), whole)
    assert_refused(lambda: nacre.load(folder, quantity="radiance"), "do not state it again")
    write_list(folder, text.replace("60,30\n", "60,30,albedo\n"))
    assert_refused(lambda: nacre.load(folder), "line 5: quantity 'albedo', expected reflectance")


def test_jpeg_images_are_read(folder: Path) -> None:
    ramp = np.broadcast_to(np.arange(40, 40 + 4 * WIDTH, 4, "u1")[:, None], (HEIGHT, WIDTH, 3))
    write_image(folder / "c.JPG", np.ascontiguousarray(ramp))
    write_list(folder, ANGLES.replace("more/b.exr", "c.JPG"))
    picture = nacre.load(folder).images([1])[0]
    np.testing.assert_allclose(picture, linear(ramp), atol=0.01)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("theta_v,phi_v,", "theta_v,", "columns: phi_v missing"),
        ("phi_v", "lx", "column 'theta_v' is not one of file, lx"),
        ("phi_v", "φ_v", "column 'φ_v' is not one of"),
        ("phi_l", "phi_v", "columns: phi_l missing"),
        ("phi_l", "phi_l,phi_l", "appears twice"),
        ("phi_l", "phi_l,f", "column 'f' is not one of file, theta_l"),
        ("file", "image", "'image' is not one of"),
        ("60,30", "60", "line 5: 4 values, not 5"),
        ("60,30", "60,30,1", "line 5: 6 values, not 5"),
        ("60,30", "95,30", "line 5: column theta_l: 95 is not from 0"),
        ("60,30", "-60,30", "line 5: column theta_l: -60 is not from 0 to below 90 degrees"),
        ("12.5,271", "110,271", "column theta_v: 110 is not from 0"),
        ("60,30", "٦٠,30", "line 5: column theta_l: '٦٠' is not a finite number"),
        ("60,30", "6_0,30", "line 5: column theta_l: '6_0' is not a finite number"),
        ("60,30", "nan,30", "'nan' is not a finite number"),
        ("60,30", "60,inf", "'inf' is not a finite number"),
        ("60,30", "60,", "column phi_l: '' is not a finite number"),
        ("60,30", '"60,30', "line 5: quotes do not match"),
        ("more/b.exr", "b.exr", "line 5: file 'b.exr' is not in"),
        ("more/b.exr", "../felt/a.png", "is not a path within the folder"),
        ("more/b.exr", "/etc/passwd", "is not a path within the folder"),
        ("more/b.exr", "", "is not a path within the folder"),
        ("12.5,271,more/b.exr,60,30", "45,180,more/b.exr,0,0", "line 3 and line 5 have the same"),
        ("more/b.exr", "directions.csv", "is not an OpenEXR, PNG or JPEG image"),
        (ANGLES, "# nothing\n", "lists no images"),
        (ANGLES, ANGLES[: ANGLES.index("45")], "lists no images"),
        (ANGLES, "", "is empty"),
    ],
)
def test_bad_lists_are_refused(folder: Path, old: str, new: str, words: str) -> None:
    assert old in ANGLES
    write_list(folder, ANGLES.replace(old, new, 1))
    assert_refused(lambda: nacre.load(folder), str(folder / "directions.csv"), words)


@pytest.mark.parametrize(
    ("vector", "words"),
    [
        ("0.6,0,-0.8", "lights: line 2, (0.6, 0, -0.8), is not above the horizon"),
        ("0.6,0,0.9", "is not of unit length"),
        ("0,0,0", "is not of unit length"),
        ("1e300,0,0", "is not"),
        ("0,0,1e999", "is not a finite number"),
    ],
)
def test_bad_vectors_are_refused(folder: Path, vector: str, words: str) -> None:
    write_list(folder, f"file,lx,ly,lz,vx,vy,vz\na.png,{vector},0,0,1\n")
    assert_refused(lambda: nacre.load(folder), "directions.csv", words)


def test_lists_that_are_none_are_refused(folder: Path, tmp_path: Path) -> None:
    assert_refused(lambda: load_photographs(tmp_path), "no such file")
    path = folder / "directions.csv"
    path.write_bytes(ANGLES.encode("utf-32"))
    assert_refused(lambda: nacre.load(folder), str(path), "is UTF-32")
    path.write_text(ANGLES + "x" * 70_000)
    assert_refused(lambda: nacre.load(folder), str(path), "line 6: is longer than")
    path.unlink()
    path.symlink_to(path)
    assert_refused(lambda: load_photographs(folder), str(path), "cannot be read")
    path.unlink()
    with path.open("wb") as file:
        file.truncate(1 << 40)
    assert_refused(lambda: nacre.load(folder), str(path), "more than")


def test_a_scale_makes_up_for_the_exposure(folder: Path) -> None:
    text = ANGLES.replace("phi_l\n", "phi_l,scale\n").replace("0,0\n", "0,0,4\n")
    write_list(folder, text.replace("60,30\n", "60,30,0.5\n"))
    first, second = nacre.load(folder).images(slice(None))
    np.testing.assert_allclose(first, 4.0 * linear(pixels(0)), rtol=2e-5, atol=1e-7)
    np.testing.assert_allclose(second, 0.5 * pixels(1, "f4"))
    write_list(folder, text.replace("60,30\n", "60,30,0\n"))
    assert_refused(lambda: nacre.load(folder), "line 5: column scale: 0 is not above 0")
    write_list(folder, text.replace("60,30\n", "60,30,bright\n"))
    assert_refused(lambda: nacre.load(folder), "line 5: column scale: 'bright' is not a finite")
