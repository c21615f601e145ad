"""The environment: orientation, look-up, quadrature, files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from nacre.color import luminance
from nacre.errors import FormatError
from nacre.mitsuba.environment import Environment, load_environment, pixel_directions, sphere_mean
from nacre.mitsuba.lights import golden_lattice, quadrature
from nacre.mitsuba.studio import studio
from tests.data import require_data
from tests.variants import require_mitsuba


def unit_vectors(count: int) -> np.ndarray:
    """Random directions over the whole sphere."""
    vectors = np.random.default_rng(5).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def gradient(height: int = 64, width: int = 128) -> Environment:
    """A smooth map: radiance 1 + y, 1 + x, 1 + z."""
    directions, _ = pixel_directions(height, width)
    return Environment((1.0 + directions[..., [1, 0, 2]]).astype(np.float32))


def test01_pixels_cover_the_sphere():
    directions, solid_angles = pixel_directions(17, 30)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-12)
    assert solid_angles.sum() * 30 == pytest.approx(4.0 * math.pi)


def test02_middle_of_the_map_is_behind_the_viewer():
    pixels = np.zeros((65, 128, 3), np.float32)
    pixels[32, 63:65] = 1.0
    environment = Environment(pixels)
    np.testing.assert_allclose(environment.radiance([0.0, 0.0, 1.0]), 1.0, atol=1e-6)
    np.testing.assert_array_equal(environment.radiance([0.0, 0.0, -1.0]), 0.0)


def test03_lookup_reproduces_a_smooth_map():
    directions = unit_vectors(1000)
    expected = 1.0 + directions[:, [1, 0, 2]]
    np.testing.assert_allclose(gradient(256, 512).radiance(directions), expected, atol=1e-3)


def test04_lookup_agrees_with_mitsuba():
    mi = require_mitsuba()
    directions = unit_vectors(2000).astype(np.float32)
    emitter = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(studio().pixels)})
    interaction = mi.SurfaceInteraction3f()
    interaction.wi = mi.Vector3f(-directions.T)
    expected = np.array(emitter.eval(interaction)).T
    np.testing.assert_allclose(studio().radiance(directions), expected, rtol=2e-3, atol=2e-3)


def test05_nearest_pixel_is_the_one_at_its_centre():
    environment = gradient(9, 16)
    rows, columns = environment.pixel(pixel_directions(9, 16)[0][1:-1])
    np.testing.assert_array_equal(rows, np.broadcast_to(np.arange(1, 8)[:, None], rows.shape))
    np.testing.assert_array_equal(columns, np.broadcast_to(np.arange(16), columns.shape))


@pytest.mark.parametrize("environment", [gradient(), studio()], ids=["gradient", "studio"])
def test06_quadrature_integrates(environment: Environment):
    directions, weights = quadrature(environment, 2048)
    assert directions.dtype == weights.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-6)
    centres, solid_angles = pixel_directions(*environment.pixels.shape[:2])
    for power in (0, 2, 4):
        estimate = (directions[:, 1:2] ** power * weights).sum(axis=0)
        exact = np.einsum("hwc,hw,h->c", environment.pixels, centres[..., 1] ** power, solid_angles)
        np.testing.assert_allclose(estimate, exact, rtol=0.01)


def test07_quadrature_is_deterministic_and_of_even_luminance():
    first, second = quadrature(studio(), 300), quadrature(studio(), 300)
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])
    power = luminance(tuple(first[1].T))
    np.testing.assert_allclose(power, power[0], rtol=1e-5)


def test08_quadrature_skips_what_is_black():
    pixels = np.zeros((16, 32, 3), np.float32)
    pixels[4, 10] = (1.0, 2.0, 3.0)
    environment = Environment(pixels)
    directions, weights = quadrature(environment, 50)
    np.testing.assert_array_equal(np.stack(environment.pixel(directions)), [[4] * 50, [10] * 50])
    np.testing.assert_allclose(weights / weights[:, :1], [[1.0, 2.0, 3.0]] * 50, rtol=1e-6)


def test09_quadrature_of_nothing_is_refused():
    with pytest.raises(ValueError, match="at least one"):
        quadrature(studio(), 0)


def test10_lattice_fills_the_square():
    u, v = golden_lattice(1000)
    assert np.all((u >= 0.0) & (u < 1.0) & (v >= 0.0) & (v < 1.0))
    counts, _, _ = np.histogram2d(u, v, bins=10, range=[[0.0, 1.0], [0.0, 1.0]])
    assert counts.min() >= 8
    assert counts.max() <= 12


def test11_studio_is_neutral_exposed_and_bright_in_places():
    pixels = studio().pixels
    assert pixels.shape == (256, 512, 3)
    assert pixels.dtype == np.float32
    assert pixels.min() > 0.0
    np.testing.assert_allclose(sphere_mean(pixels), 0.8, rtol=1e-5)
    assert pixels.max() > 100.0
    upper, lower = pixels[:100].mean(), pixels[156:].mean()
    assert upper > 2.0 * lower


def test12_exposure_of_white_light():
    white = Environment(np.full((8, 16, 3), 7.0, np.float32)).exposed()
    np.testing.assert_allclose(white.pixels, 0.8, rtol=0.02)


@pytest.mark.parametrize(
    ("pixels", "complaint"),
    [
        (np.zeros((4, 8)), "2 x 2 pixels"),
        (np.ones((1, 1, 3)), "2 x 2 pixels"),
        (np.zeros((4, 8, 3)), "black"),
        (np.full((4, 8, 3), -1.0), "non-negative"),
        (np.full((4, 8, 3), np.nan), "finite"),
    ],
)
def test13_unusable_maps_are_refused(pixels: np.ndarray, complaint: str):
    with pytest.raises(ValueError, match=complaint):
        Environment(pixels.astype(np.float32))


@pytest.mark.parametrize("suffix", [".exr", ".hdr"])
def test14_files_round_trip(tmp_path: Path, suffix: str):
    mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    path = tmp_path / f"map{suffix}"
    mi.Bitmap(gradient().pixels).write(str(path))
    loaded = load_environment(path)
    assert loaded.name == "map"
    np.testing.assert_allclose(loaded.pixels, gradient().pixels, rtol=0.02, atol=0.02)


def test15_png_is_made_linear(tmp_path: Path):
    Image.new("RGB", (8, 4), (188, 188, 188)).save(tmp_path / "gray.png")
    loaded = load_environment(tmp_path / "gray.png")
    np.testing.assert_allclose(loaded.pixels, 0.503, atol=0.003)


@pytest.mark.parametrize(
    "name", ["map.txt", "absent.exr", "broken.exr", "broken.hdr", "black.png", "tiny.png"]
)
def test16_bad_files_are_named(tmp_path: Path, name: str):
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    path = tmp_path / name
    if name.startswith("black"):
        Image.new("RGB", (8, 4)).save(path)
    elif name.startswith("tiny"):
        Image.new("RGB", (1, 1), (188, 188, 188)).save(path)
    elif not name.startswith("absent"):
        path.write_bytes(b"#?RADIANCE nonsense" * 10)
    with pytest.raises(FormatError, match=name) as caught:
        load_environment(path)
    assert "shape" not in str(caught.value)


def test17_real_map_loads():
    environment = load_environment(require_data("environment", "museum.exr"))
    assert environment.pixels.shape == (256, 512, 3)
    exposed = environment.exposed()
    assert luminance(tuple(sphere_mean(exposed.pixels))) == pytest.approx(0.8, rel=1e-5)
