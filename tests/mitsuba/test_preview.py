"""Previews: scenes, pictures and their files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from nacre.errors import FormatError, NacreError
from nacre.mitsuba import mitsuba
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.preview import check_image_path, render_preview, write_bytes, write_image
from nacre.mitsuba.scene import LIGHTS, SHAPES, ball_profile, describe_scene
from tests.mitsuba.reflectances import Constant

pytest.importorskip("mitsuba", reason="needs the extra 'render'")


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("light", LIGHTS)
def test01_every_scene_renders(shape: str, light: str):
    seen: list[float] = []
    image = render_preview(Constant(1.0), shape, light, (40, 24), spp=20, progress=seen.append)
    assert image.shape == (24, 40, 3)
    assert image.dtype == np.float32
    assert np.isfinite(image).all()
    assert image[8:16, 16:24].mean() > 0.3
    assert seen == [16 / 20, 1.0]


def test02_the_seed_decides():
    first, again, other = (
        render_preview(Constant(1.0), "sphere", size=16, spp=4, seed=s) for s in (1, 1, 2)
    )
    # Threads add samples to a pixel in any order: equal but for rounding.
    np.testing.assert_allclose(first, again, rtol=1e-5)
    assert np.abs(first - other).mean() > 1e-3


def test03_white_is_about_0_8():
    image = render_preview(Constant(1.0), "ball", size=32, spp=64)
    assert image[8:20, 12:20].mean() == pytest.approx(0.8, abs=0.12)


def test04_the_given_environment_lights():
    red = np.zeros((8, 16, 3), np.float32)
    red[..., 0] = 1.0
    image = render_preview(
        Constant(1.0), "sphere", size=16, spp=4, environment=Environment(red), denoise=False
    )
    assert image[..., 0].mean() > 0.1
    np.testing.assert_array_equal(image[..., 1:], 0.0)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"shape": "cube"}, "ball, sphere"),
        ({"light": "candle"}, "environment, directional"),
        ({"size": 0}, "pixels per edge"),
        ({"size": (16, 100_000)}, "pixels per edge"),
        ({"spp": 0}, "at least 1 sample"),
    ],
)
def test05_bad_arguments_name_the_choice(arguments: dict, complaint: str):
    with pytest.raises(NacreError, match=complaint):
        render_preview(Constant(1.0), **arguments)


def test06_the_ball_is_a_closed_solid():
    theta, radius = ball_profile()
    assert theta[0] == 0.0
    assert theta[-1] == pytest.approx(math.pi)
    assert np.all(np.diff(theta) > 0.0)
    assert radius.max() == 1.0
    assert radius.min() == pytest.approx(0.86)
    mi = mitsuba()
    described = describe_scene({"type": "diffuse"})
    scene = mi.load_dict({"type": "scene", "ball": described["ball"]})
    outward = np.random.default_rng(0).normal(size=(4000, 3)).astype(np.float32)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    origin = np.float32([0.0, 1.12, 0.0]) + 3.0 * outward
    hit = scene.ray_intersect(mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(-outward.T)))
    assert np.all(hit.is_valid())
    distances = np.linalg.norm(np.array(hit.p).T - [0.0, 1.12, 0.0], axis=1)
    assert 0.85 < distances.min() < distances.max() < 1.01
    for normals in (np.array(hit.n).T, np.array(hit.sh_frame.n).T):
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
        assert np.einsum("ij,ij->i", normals, outward).min() > 0.0


def test07_exr_keeps_linear_values(tmp_path: Path):
    image = np.random.default_rng(0).random((5, 7, 3), dtype=np.float32) * 10.0
    write_image(image, tmp_path / "a.exr")
    read = np.array(mitsuba().Bitmap(str(tmp_path / "a.exr")))
    np.testing.assert_array_equal(read, image)


@pytest.mark.parametrize(("name", "tolerance"), [("a.png", 0), ("a.jpg", 2), ("A.JPEG", 2)])
def test08_pictures_are_tone_mapped(tmp_path: Path, name: str, tolerance: int):
    image = np.full((8, 8, 3), 0.5, np.float32)
    image[:, 4:] = 3.0
    write_image(image, tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    with Image.open(tmp_path / name) as opened:
        read = np.array(opened).astype(int)
    assert abs(read[2, 1] - round(0.5 ** (1 / 2.2) * 255)).max() <= tolerance
    assert abs(read[2, 6] - 255).max() <= tolerance


@pytest.mark.parametrize("name", ["a.gif", "a"])
def test09_bad_paths_are_known_before_rendering(tmp_path: Path, name: str):
    with pytest.raises(FormatError, match=name):
        check_image_path(tmp_path / name)


def test10_display_values_do_not_go_into_exr(tmp_path: Path):
    with pytest.raises(FormatError, match="a picture ends in one of"):
        write_bytes(np.zeros((2, 2, 3), np.uint8), tmp_path / "a.exr")
    assert not list(tmp_path.iterdir())


def test11_a_bsdf_of_mitsuba_is_shown_too() -> None:
    ours = render_preview(Constant(0.5), "sphere", size=16, spp=64)
    theirs = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    image = render_preview(theirs, "sphere", size=16, spp=64)
    assert image.mean() == pytest.approx(ours.mean(), rel=0.02)
