"""Pictures as sums: each against Mitsuba's own rendering of the same scene and material."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import Ggx
from nacre.errors import NacreError
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import EnvironmentLight
from nacre.mitsuba.sphere import render_sphere
from nacre.photographs.recording import Recording, block, record, shrunk, sphere_scene

SIZE = 16
PAINT = Ggx(diffuse=(0.3, 0.1, 0.05), specular=(0.05, 0.06, 0.07), roughness=0.3)
METAL = Ggx(diffuse=(0.0, 0.0, 0.0), specular=(0.9, 0.7, 0.4), roughness=0.15)
POINT = {"type": "point", "position": [2.0, 3.0, 4.0], "intensity": 20.0}


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    """No materials of other scenes, which Dr.Jit would compile into each kernel."""
    gc.collect()
    yield
    gc.collect()


def sky() -> Environment:
    """Light that is brighter above, and redder at the right, with a lamp in it."""
    height, width = 16, 32
    v, u = np.mgrid[0:height, 0:width] / [[[height - 1.0]], [[float(width)]]]
    pixels = np.stack([1.2 + np.sin(2 * np.pi * u), 1.5 - v, 0.3 + v], axis=-1)
    pixels[4:6, 14:17] += 20.0
    return Environment(pixels.astype(np.float32), "sky")


def envmap(mi: Any) -> dict[str, Any]:
    return {"type": "envmap", "bitmap": mi.Bitmap(sky().pixels)}


def loaded(mi: Any, light: Any, material: Any, **more: Any) -> Any:
    scene = sphere_scene(light, SIZE)
    scene["shape"]["bsdf"] = nacre.mitsuba.bsdf(material)
    scene["integrator"] = {"type": "path", "max_depth": 8 if more else 2}
    return mi.load_dict(scene | more)


def summed(recording: Recording, material: Any) -> Any:
    """What each recorded pixel shows of a material, shape (n, 3)."""
    wi, wo = (w.reshape(-1, 3) for w in (recording.wi, recording.wo))
    f_r = material.eval(wi, wo).reshape(recording.weights.shape)
    return (f_r * recording.weights).sum(axis=1)


def recorded(scene: Any, **settings: Any) -> Recording:
    (material,) = {s.bsdf() for s in scene.shapes() if "Reflectance" in str(s.bsdf())}
    return record(scene, 0, material, (SIZE, SIZE), **settings)


def assert_shows(mi: Any, scene: Any, recording: Recording, material: Any, within: float) -> None:
    """The sum is Mitsuba's picture: in each pixel but for noise, and in the mean."""
    picture = np.array(mi.render(scene, spp=400, seed=7))
    expected = picture[tuple(recording.pixels.T)]
    misses = summed(recording, material) / expected - 1.0
    assert np.abs(misses).mean() < within
    assert np.quantile(np.abs(misses), 0.9) < 3.0 * within
    assert np.abs(misses.mean(axis=0)).max() < 0.02


def test_under_a_map_the_sum_is_what_mitsuba_renders(rgb):
    scene = loaded(rgb, envmap(rgb), PAINT)
    recording = recorded(scene)
    assert 120 < len(recording.pixels) < 200  # of 256, a circle without its rim
    assert_shows(rgb, scene, recording, PAINT, within=0.05)


def test_lobes_of_the_material_record_it_with_less_noise(rgb):
    scene = loaded(rgb, envmap(rgb), METAL)
    assert_shows(rgb, scene, recorded(scene), METAL, within=0.08)
    assert_shows(rgb, scene, recorded(scene, lobes=METAL.sampler), METAL, within=0.04)


def test_under_a_point_that_no_direction_meets(rgb):
    scene = loaded(rgb, POINT, PAINT)
    recording = recorded(scene, samples=16)
    picture = np.array(rgb.render(scene, spp=400, seed=7))
    expected = picture[tuple(recording.pixels.T)]
    # At the edge of the shadow pixels are nearly black.
    np.testing.assert_allclose(summed(recording, PAINT), expected, atol=0.03 * expected.max())
    behind = loaded(rgb, POINT | {"position": [0.0, 0.0, -9.0]}, PAINT)
    with pytest.raises(NacreError, match="no light reaches the material"):
        recorded(behind, samples=16, seed=2**32 - 1)


def test_things_stand_in_front_walls_give_light_and_lamps_hide_what_is_behind(rgb):
    turn = rgb.ScalarTransform4f()
    left = turn.translate([1.5, 0.0, 0.5]).rotate([0, 1, 0], -90)
    more = {
        "ball": {"type": "sphere", "to_world": turn.translate([0.4, 0.4, 1.6]).scale(0.25)},
        "lamp": {
            "type": "rectangle",
            "to_world": left,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 0.5}},
        },
        "wall": {"type": "rectangle", "to_world": turn.translate([2.0, 0.0, 0.0]) @ left},
        # In front of the lamp: the sphere is lit by the wall, which the lamp hides from it.
        "point": {"type": "point", "position": [3.2, 0.0, 0.5], "intensity": 40.0},
    }
    scene = loaded(rgb, {"type": "constant", "radiance": 0.1}, PAINT, **more)
    recording = recorded(scene)
    y, x = (recording.pixels.T - 7.5) * [[-1.0], [1.0]] * 2.0 / SIZE / 0.97
    away = np.hypot(x - 0.4, y - 0.4)
    assert 0.25 < away.min() < 0.45
    assert len(recording.pixels) > 100
    assert_shows(rgb, scene, recording, PAINT, within=0.04)


def test_the_view_is_that_of_the_deterministic_sphere(rgb):
    recording = recorded(loaded(rgb, envmap(rgb), PAINT))
    picture, _ = render_sphere(PAINT, EnvironmentLight(sky()), SIZE)
    expected = picture[tuple(recording.pixels.T)]
    found = summed(recording, PAINT)
    inner = np.hypot(*(recording.pixels.T - 7.5)) < 6.0  # where a pixel is much like its center
    assert np.abs(found[inner] / expected[inner] - 1.0).mean() < 0.04


def test_large_pictures_are_recorded_in_blocks():
    image = np.arange(4 * 200 * 3, dtype=float).reshape(4, 200, 3)
    assert block((4, 200)) == 3
    assert shrunk(image).shape == (1, 66, 3)
    np.testing.assert_allclose(shrunk(image)[0, 1], image[:3, 3:6].mean(axis=(0, 1)))
    np.testing.assert_array_equal(shrunk(image[:, :96]), image[:, :96])
    image[0, 0] = np.inf, -np.inf, np.nan
    image[1, 1, 0] = -np.inf
    assert not np.isfinite(shrunk(image)[0, 0]).any()
    assert np.isfinite(shrunk(image)[0, 1:]).all()


def test_what_shows_nothing_is_refused(rgb):
    scene = loaded(rgb, envmap(rgb), PAINT)
    other = rgb.load_dict({"type": "diffuse"})
    with pytest.raises(NacreError, match="no pixel shows the front of the material alone"):
        record(scene, 0, other, (SIZE, SIZE), samples=4)
    with pytest.raises(NacreError, match="1000 x 2 pixels is too narrow"):
        record(scene, 0, scene.shapes()[0].bsdf(), (2, 1000), samples=4)
