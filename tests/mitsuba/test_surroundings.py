"""The environments beside the studio: what their descriptions promise, by integration."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.color import luminance
from nacre.mitsuba.environment import EXPOSURE, Environment, pixel_directions, sphere_mean
from nacre.mitsuba.surroundings import ENVIRONMENTS


def luminances(environment: Environment) -> np.ndarray:
    return luminance(tuple(np.moveaxis(environment.pixels.astype(float), 2, 0)))


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_each_is_exposed_known_by_its_name_and_whole_around_the_seam(name: str):
    environment = ENVIRONMENTS[name]()
    assert environment.name == name
    assert float(luminance(tuple(sphere_mean(environment.pixels)))) == pytest.approx(EXPOSURE)
    lit = np.log(luminances(environment))
    steps = np.abs(np.diff(lit, axis=1, append=lit[:, :1]))
    assert np.median(steps[:, -1]) < 3.0 * np.median(steps) + 0.01


def test_an_overcast_sky_is_the_standard_one_over_gray_ground():
    environment = ENVIRONMENTS["overcast"]()
    assert np.ptp(mean := sphere_mean(environment.pixels)) < 1e-3 * mean.mean()
    directions, angles = pixel_directions(*environment.pixels.shape[:2])
    lit, rows = luminances(environment).mean(axis=1), directions[:, 0, 1]
    overhead = rows > 0.2
    shape = lit[overhead] / (1.0 + 2.0 * rows[overhead])
    assert np.allclose(shape, shape.mean(), rtol=0.12)
    down = (lit * np.maximum(rows, 0.0) * angles)[rows > 0.0].sum() * environment.pixels.shape[1]
    ground = lit[rows < -0.1].mean()
    assert ground * math.pi / down == pytest.approx(0.2, rel=0.1)


def test_the_late_sun_is_low_at_the_left_and_warm():
    environment = ENVIRONMENTS["late sun"]()
    directions, _ = pixel_directions(*environment.pixels.shape[:2])
    x, y, z = directions.reshape(-1, 3)[np.argmax(luminances(environment))]
    assert x < -0.5
    assert 0.05 < y < 0.35
    assert z > 0.0
    red, _, blue = environment.pixels.reshape(-1, 3).max(axis=0)
    assert red > 3.0 * blue


def test_daylight_in_the_room_comes_from_the_left_and_lamps_are_warmer():
    radiance = ENVIRONMENTS["room"]().radiance
    window, wall, lamp = radiance([[-1.0, 0.1, 0.03], [1.0, 0.0, 0.0], [0.745, 0.197, 0.657]])
    assert window.min() > 5.0 * wall.max()
    assert window[2] > window[0]
    assert lamp[0] > 2.0 * lamp[2]
