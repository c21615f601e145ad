"""Parallax over height fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nacre.render.textures.plugins import texture_bsdf
from nacre.render.textures.relief import Relief

from .made import factors_at, hemisphere, picture


def write_heights(mi: Any, path: Path, heights: Any) -> str:
    """A gray image of values from 0 to 1."""
    mi.Bitmap(np.asarray(heights, np.float32)[:, :, None]).write(str(path))
    return str(path)


def test_a_flat_field_changes_nothing(rgb: Any, tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).random((4, 4, 3))
    flat = write_heights(rgb, tmp_path / "flat.exr", np.full((8, 8), 0.7))
    bumpy = write_heights(rgb, tmp_path / "bumpy.exr", np.random.default_rng(2).random((8, 8)))
    uv, wo = np.random.default_rng(3).random((500, 2)), hemisphere(500, 4)
    plain, same, other = (
        factors_at(rgb, texture_bsdf(picture(pixels), interpolation="linear", **o), uv, wo, wo)
        for o in (
            {},
            {"height_field": flat, "depth": 0.3},
            {"height_field": bumpy, "depth": 0.3},
        )
    )
    np.testing.assert_array_equal(same, plain)
    assert np.abs(other - plain).mean() > 0.02


def test_rays_meet_the_field_first_where_a_fine_march_does(rgb: Any) -> None:
    size, depth, aspect = 64, 0.2, 2.0
    y, x = np.mgrid[:size, :size] / size
    heights = 0.5 + 0.25 * np.sin(2 * np.pi * x) + 0.25 * np.cos(2 * np.pi * y)
    relief = Relief(rgb, heights, depth, aspect)
    uv = np.random.default_rng(5).random((300, 2)).astype(np.float32)
    view = hemisphere(300, 6, 0.5)
    components = tuple(rgb.Vector3f(np.ascontiguousarray(view.T)))
    found = np.array(relief.seen(rgb.Point2f(np.ascontiguousarray(uv.T)), components)).T

    slope = np.stack([view[:, 0], -aspect * view[:, 1]], -1) / view[:, 2:]
    levels = np.linspace(0.5, -0.5, 4001) * depth  # from the highest point to the lowest
    along = uv[:, None] + slope[:, None] * levels[:, None]
    u, v = along[..., 0] - 0.5 / size, along[..., 1] - 0.5 / size  # pixels have middles
    field = depth * (0.25 * np.sin(2 * np.pi * u) + 0.25 * np.cos(2 * np.pi * v))
    first = (levels <= field).argmax(1)
    expected = along[np.arange(300), first]
    close = np.abs(found - expected).max(1) < 0.01
    assert close.mean() > 0.97  # a step may pass over a thin crest
    assert np.abs(expected - uv).max() > 0.05
