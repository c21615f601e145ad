"""Rays of paths whose number is known."""

from __future__ import annotations

import pytest

pytest.importorskip("mitsuba", reason="needs the extra 'render'")

from nacre.mitsuba.engine import mitsuba as engine
from nacre.mitsuba.scene import camera, path_traced, rgb
from nacre_lab.reproduce.kitchen import sphere
from nacre_lab.reproduce.ray_count import rays_per_path

CAMERA = camera([0.0, 0.0, 0.0], [0.0, 0.0, -1.0], 40.0, (32, 32))
SKY = {"type": "constant"}
WHITE = {"type": "diffuse", "reflectance": rgb(1.0)}
ROOM = sphere([0.0, 0.0, 0.0], 3.0, flip_normals=True, bsdf=WHITE)


def count(depth: int, **scene: object) -> float:
    loaded = engine().load_dict({**path_traced(depth, CAMERA), **scene})
    return rays_per_path(loaded, depth, 1 << 15)


def test_a_path_into_the_open_is_one_ray():
    assert count(6, sky=SKY) == 1.0


def test_a_path_in_a_white_room_has_all_its_segments_and_one_ray_to_the_light_at_each_hit():
    assert count(4, room=ROOM) == 4.0  # there is no light to look for
    assert count(4, room=ROOM, sky=SKY) == 7.0


def test_long_paths_end_at_random_as_mitsuba_ends_them():
    after_five = sum(0.95**k for k in (1, 2, 3))
    expected = 5 + 5 + 2 * after_five - 0.95**3  # the last segment looks for no light
    assert count(8, room=ROOM, sky=SKY) == pytest.approx(expected, rel=3e-3)
