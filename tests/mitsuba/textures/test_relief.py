"""Parallax over height fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.measured.textures.directions import from_degrees
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.textures.relief import Relief
from nacre.textures.capture import capture
from nacre.textures.capture.recipe import find
from nacre.textures.height_file import full_depth, read_heights, write_heights

from .made import factors_at, hemisphere, picture


def test_a_flat_field_changes_nothing(rgb: Any, tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).random((4, 4, 3))
    flat, bumpy = str(tmp_path / "flat.exr"), str(tmp_path / "bumpy.exr")
    write_heights(np.full((8, 8), 0.7), flat)
    write_heights(np.random.default_rng(2).random((8, 8)), bumpy)
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
    assert close.mean() > 0.99  # a step may pass over a thin crest
    assert np.abs(expected - uv).max() > 0.05


def test_points_of_a_surface_are_seen_where_its_photographs_have_them(
    rgb: Any, tmp_path: Path
) -> None:
    """Texels of the heights that rays meet are those of the plane, of the tracer's triangles."""
    size = 128
    surface = find("leather12").build(size)
    view = from_degrees(60.0, 30.0)[None]
    light = from_degrees(40.0, 200.0)[None]
    plane, points = (
        capture(surface, light, view, size, samples=8, on_surface=on_surface).values[:, :, 0]
        for on_surface in (False, True)
    )
    write_heights(surface.height_map(), tmp_path / "heights.exr")
    heights = read_heights(tmp_path / "heights.exr")
    np.testing.assert_array_equal(heights, surface.height_map())
    relief = Relief(rgb, heights, full_depth(tmp_path / "heights.exr"), 1.0)
    y, x = np.mgrid[:size, :size].reshape(2, -1)
    uv = np.stack([x + 1.0, y]).astype(np.float32) / size  # pictures are half a cell apart
    wo = rgb.Vector3f(np.repeat(view.T, size * size, 1).astype(np.float32))
    texels = rgb.TensorXf(points.astype(np.float32))
    texture = rgb.Texture2f(texels, wrap_mode=dr.WrapMode.Repeat)

    def error(where: Any) -> float:
        seen = np.array(texture.eval(where)).T.reshape(size, size, 3)
        return float(np.square(seen - plane).mean())

    without, met = rgb.Point2f(uv), relief.seen(rgb.Point2f(uv), tuple(wo))
    assert error(met) < 0.2 * error(without)


def test_heights_are_written_as_values(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="a height field that is written ends in"):
        write_heights(np.zeros((2, 2)), tmp_path / "heights.png")
    assert full_depth("heights.png") == 0.1
