"""Sheets of pictures: the memory they take, and what lies where."""

from __future__ import annotations

import tracemalloc

import numpy as np

from nacre.btf import TableBtf
from nacre.figures.texture_views import capture_sheet as sheet
from nacre.measured.textures.directions import from_degrees
from nacre.measured.textures.domes import pairs

ANGLES = [0.0, 45.0, 45.0, 45.0, 75.0, 75.0], [0.0, 0.0, 90.0, 180.0, 0.0, 90.0]
DIRECTIONS = from_degrees(*ANGLES).astype(np.float32)


def plain(size: int) -> TableBtf:
    """Every picture of one gray: the cosine of the view over that of the light."""
    wi, wo = pairs(DIRECTIONS, DIRECTIONS)
    grey = (wo[:, 2] / wi[:, 2]).astype(np.float16)[:, None]
    return TableBtf(np.broadcast_to(grey, (size, size, len(wi), 3)), wi, wo)


def test_a_sheet_shows_lights_across_and_views_down() -> None:
    """Under a lamp of the same power, so that the cosine of the light comes out."""
    found = sheet(plain(4))
    expected = 0.8 * np.cos(np.radians([0.0, 45.0, 75.0]))
    cells = found.reshape(3, len(found) // 3, 4, -1, 3)
    assert (cells[:, [0, -1]] == 1.0).all()
    inside = cells[:, 1:-1, :, 1:-1]
    np.testing.assert_allclose(inside, np.broadcast_to(expected[:, None, None, None, None],
                                                       inside.shape), rtol=2e-3)  # fmt: skip


def test_a_sheet_of_large_pictures_takes_the_memory_of_a_few() -> None:
    texture = plain(1024)
    picture = texture.images(np.array([0])).nbytes
    tracemalloc.start()
    try:
        shape = sheet(texture).shape
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert shape == (3 * (2 * 256 + 2), 4 * (2 * 256 + 2), 3)
    assert peak < 12 * picture
