"""A light on its way: where it is, and that moving it gives what a scene of its own gives."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.mitsuba.moving_light import light_path, render_moving
from nacre.mitsuba.preview import render_scene
from nacre.mitsuba.textures.scene import GEOMETRIES, describe_texture_scene, facing, light_direction
from tests.variants import require_mitsuba


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_around_keeps_its_angle_and_closes(geometry: str) -> None:
    around = light_path("around", 12, 50.0, geometry)
    np.testing.assert_allclose(np.linalg.norm(around, axis=1), 1.0)
    np.testing.assert_allclose(around[0], light_direction(50.0))
    assert np.ptp(around @ np.array(facing(geometry))) < 1e-12
    steps = [a @ b for a, b in itertools.pairwise([*around, around[0]])]
    np.testing.assert_allclose(steps, steps[0])
    np.testing.assert_allclose((around @ facing(geometry))[0], around.mean(0) @ facing(geometry))


def test_over_rises_from_the_left_and_sets_at_the_right() -> None:
    over = light_path("over", 17, 30.0)
    np.testing.assert_allclose(np.linalg.norm(over, axis=1), 1.0)
    np.testing.assert_allclose(np.degrees(np.arcsin(over[:, 0])), np.linspace(-80, 80, 17))
    np.testing.assert_allclose(over[8], [0.0, 0.5, np.sqrt(0.75)], atol=1e-12)
    assert (over[:, 1] > 0).all()


def test_paths_that_are_none() -> None:
    with pytest.raises(NacreError, match="choose one of around, over"):
        light_path("under", 3, 45.0)
    with pytest.raises(NacreError, match="at least 1 direction"):
        light_path("over", 0, 45.0)


@pytest.mark.parametrize("light", ["directional", "point"])
def test_a_moved_light_is_as_one_that_was_there(light: str) -> None:
    mi = require_mitsuba()
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    scene = describe_texture_scene(grey, "sphere", light, (16, 16), 0.0)
    angles = (70.0, 10.0)
    directions = np.array([light_direction(angle) for angle in angles])
    done: list[float] = []
    moved = list(render_moving(scene, directions, 4, 5, done.append))
    assert done == [0.5, 1.0]
    for angle, picture in zip(angles, moved, strict=True):
        there = describe_texture_scene(grey, "sphere", light, (16, 16), angle)
        np.testing.assert_allclose(picture, render_scene(mi.load_dict(there), 4, 5), atol=1e-4)
    assert np.abs(moved[0] - moved[1]).max() > 0.1


def test_light_from_below_needs_that_no_floor_is_there() -> None:
    require_mitsuba()
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    below = np.array([[0.0, -0.8, 0.6]])
    middles = []
    for standing in (True, False):
        scene = describe_texture_scene(
            grey, "sphere", "directional", (16, 16), 45.0, standing=standing
        )
        (picture,) = render_moving(scene, below, 4)
        middles.append(float(picture[7:9, 7:9].mean()))
    assert middles[0] < 0.01 < 0.2 < middles[1]


def test_an_environment_does_not_move() -> None:
    require_mitsuba()
    scene = describe_texture_scene({"type": "diffuse"}, "sphere", "environment", (8, 8))
    with pytest.raises(NacreError, match="an environment does not move"):
        next(render_moving(scene, light_path("over", 2, 45.0), 1))
