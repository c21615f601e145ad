"""The deterministic sphere against closed forms and against Mitsuba."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.color import luminance
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import DirectionalLight, EnvironmentLight, Light
from nacre.mitsuba.sphere import (
    MARGIN,
    frames,
    render_sphere,
    smooth_edges,
    sphere_normals,
    standard_lights,
)
from nacre.mitsuba.studio import studio
from tests.mitsuba.reflectances import Constant, Lobe
from tests.variants import require_mitsuba


def white_light(count: int) -> EnvironmentLight:
    """Radiance 1 from everywhere."""
    return EnvironmentLight(Environment(np.ones((64, 128, 3), np.float32)), count)


def test01_normals_cover_a_disk():
    normals, mask = sphere_normals(64)
    assert mask.mean() == pytest.approx(math.pi / 4.0 * (1.0 - MARGIN) ** 2, rel=0.01)
    np.testing.assert_allclose(np.linalg.norm(normals[mask], axis=1), 1.0, atol=1e-6)
    assert not normals[~mask].any()
    assert normals[4, 32, 1] > 0.8
    assert normals[32, 60, 0] > 0.8
    assert normals[32, 32, 2] > 0.99


def test02_frames_are_rotations_with_tangents_along_latitudes():
    normals, mask = sphere_normals(20)
    local = frames(normals[mask])
    identity = np.broadcast_to(np.eye(3), local.shape)
    np.testing.assert_allclose(local @ local.transpose(0, 2, 1), identity, atol=1e-5)
    np.testing.assert_allclose(np.linalg.det(local), 1.0, atol=1e-5)
    np.testing.assert_array_equal(local[:, 0, 1], 0.0)
    assert np.all(local[:, 0, 0] > 0.0)


def test03_white_sphere_in_white_light_is_white():
    image, mask = render_sphere(Constant(1.0), white_light(512), 32)
    assert image.shape == (32, 32, 3)
    assert image.dtype == np.float32
    np.testing.assert_allclose(image[mask], 1.0, atol=0.03)
    assert image[mask].mean() == pytest.approx(1.0, abs=0.005)
    assert not image[~mask].any()


def test04_directional_light_is_a_cosine():
    image, mask = render_sphere(Constant(1.0), DirectionalLight(), 32)
    normals, _ = sphere_normals(32)
    cosine = np.maximum(normals[mask] @ [-0.5, 0.5, math.sqrt(0.5)], 0.0)
    np.testing.assert_allclose(image[mask], np.repeat(cosine[:, None], 3, axis=1), atol=1e-5)


@pytest.mark.parametrize("exponent", [10.0, 300.0, 2e4])
def test05_lobes_of_every_width_are_integrated(exponent: float):
    image, _ = render_sphere(Lobe(exponent), white_light(512), 33)
    expected = 1.0 - math.cos(math.pi / 4.0) ** (exponent + 2.0)
    np.testing.assert_allclose(image[16, 16], [expected, 0.5 * expected, 0.0], rtol=0.02)


def test06_exposed_white_sphere_has_mean_0_8():
    image, mask = render_sphere(Constant(1.0), standard_lights()["environment"], 48)
    assert luminance(tuple(image[mask].mean(axis=0))) == pytest.approx(0.8, rel=0.01)


@pytest.mark.parametrize("material", [Constant(1.0), Lobe(400.0)], ids=["white", "glossy"])
def test07_few_directions_come_close_to_many(material: Constant | Lobe):
    few, mask = render_sphere(material, standard_lights()["environment"], 24)
    many, _ = render_sphere(material, standard_lights(count=8192)["environment"], 24)
    error = np.abs(few - many)[mask].mean() / many[mask].mean()
    assert error < 0.02


def test08_a_mirror_shows_the_map():
    image, _ = render_sphere(Lobe(1e5), standard_lights()["environment"], 33)
    np.testing.assert_allclose(image[16, 16, 0], studio().radiance([0.0, 0.0, 1.0])[0], rtol=0.25)


def test09_pictures_repeat_and_report_progress():
    seen: list[float] = []
    light = standard_lights(count=64)["environment"]
    first, _ = render_sphere(Lobe(50.0), light, 64, progress=seen.append)
    second, _ = render_sphere(Lobe(50.0), light, 64)
    np.testing.assert_array_equal(first, second)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test10_errors_of_the_material_come_through():
    class Broken(Constant):
        def eval_components(self, wi, wo):
            raise ArithmeticError("no")

    with pytest.raises(ArithmeticError, match="no"):
        render_sphere(Broken(1.0), DirectionalLight(), 16)


def test11_one_direction_is_too_few():
    with pytest.raises(ValueError, match="at least two"):
        EnvironmentLight(studio(), 1)


def test12_mitsuba_renders_the_same_white_sphere():
    mi = require_mitsuba()
    size, scale = 32, 1.0 / (1.0 - MARGIN)
    to_world = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct"},
            "sensor": {
                "type": "orthographic",
                "to_world": to_world.scale([scale, scale, 1.0]),
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "rfilter": {"type": "box"},
                    "component_format": "float32",
                },
            },
            "light": {"type": "envmap", "bitmap": mi.Bitmap(studio().pixels)},
            "sphere": {
                "type": "sphere",
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}},
            },
        }
    )
    expected = np.array(mi.render(scene, spp=8192, seed=0))
    image, mask = render_sphere(Constant(1.0), standard_lights()["environment"], size)
    normals, _ = sphere_normals(size)
    inner = mask & (normals[..., 2] > 0.4)
    np.testing.assert_allclose(image[inner], expected[inner], rtol=0.06)
    np.testing.assert_allclose(image[inner].mean(0), expected[inner].mean(0), rtol=0.01)


@pytest.mark.parametrize("light", [DirectionalLight(), white_light(64)], ids=["one", "all"])
def test13_shown_pictures_have_smooth_edges(light: Light):
    image, mask = render_sphere(Lobe(50.0), light, 24)
    before = image.copy()
    smooth, coverage = smooth_edges(image, Lobe(50.0), light)
    np.testing.assert_array_equal(image, before)
    assert coverage.mean() == pytest.approx(math.pi / 4.0 * (1.0 - MARGIN) ** 2, rel=5e-3)
    partial = (coverage > 0.0) & (coverage < 1.0)
    assert partial.sum() > 40
    assert not smooth[coverage == 0.0].any()
    inside = coverage == 1.0
    if light.count > 1:
        np.testing.assert_array_equal(smooth[inside], image[inside])
    else:
        assert np.abs(smooth[inside] - image[inside]).max() > 1e-3
    assert smooth[mask].mean() == pytest.approx(image[mask].mean(), rel=0.05)


def test14_a_shadow_ends_smoothly():
    size, light = 48, DirectionalLight()

    class Rim(Constant):
        """As bright at the shadow's edge as anywhere: what a grazing highlight comes to."""

        def eval_components(self, wi, wo):
            red, green, blue = super().eval_components(wi, wo)
            return red / wi[2], green / wi[2], blue / wi[2]

    image, mask = render_sphere(Rim(1.0), light, size)
    smooth, coverage = smooth_edges(image, Rim(1.0), light)
    inside = (coverage == 1.0) & mask
    assert set(np.unique(image[inside][:, 0].round(3))) == {0.0, 1.0}
    assert ((smooth[inside][:, 0] > 0.1) & (smooth[inside][:, 0] < 0.9)).sum() > 30
