"""What pixels see of a texture: footprints in closed form, and means over them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.mitsuba.textures.placement import Placement, footprint
from nacre.mitsuba.textures.plugins import texture_bsdf

from .made import FlatCodec, factors_at, hits, latent, picture, surface

DOWN = np.array([[0.0, 0.0, 1.0]], np.float32)


def far_hits(mi: Any, uv: Any, wo: Any, distance: float) -> Any:
    si = hits(mi, uv, wo)
    si.t = mi.Float(distance)
    return si


def seen(mi: Any, bsdf: Any, uv: Any, wi: Any, wo: Any, distance: float) -> Any:
    """Reflectance factors at hits of some distance, shape (n, 3)."""
    value = bsdf.eval(mi.BSDFContext(), far_hits(mi, uv, wo, distance), surface(mi, wi))
    return np.pi * np.array(value).T / wi[:, 2:]


@pytest.mark.parametrize("degrees", [0.0, 60.0, 80.0])
def test_a_footprint_is_as_long_as_the_view_is_steep(rgb: Any, degrees: float) -> None:
    angle = np.radians(degrees)
    view = np.array([[0.0, np.sin(angle), np.cos(angle)]], np.float32)
    si = far_hits(rgb, np.zeros((1, 2)), view, 5.0)
    found = footprint(rgb, si, Placement(rgb), 0.01, 20, 40)
    long, short = (np.array(side)[0] for side in found.texels)
    across, along = 0.05 * 40, 0.05 / np.cos(angle) * 20
    assert (long, short) == pytest.approx((max(across, along), min(across, along)), rel=1e-4)
    if degrees > 60.0:
        np.testing.assert_allclose(np.abs(np.array(found.long)[:, 0]), [0.0, along / 20], atol=1e-5)


@pytest.fixture(scope="module")
def pixels() -> Any:
    return np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)


@pytest.mark.parametrize("interpolation", ["stochastic", "linear", "nearest"])
def test_from_afar_a_texture_has_its_mean(rgb: Any, pixels: Any, interpolation: str) -> None:
    options = {"interpolation": interpolation, "resolution": 2}
    bsdf = texture_bsdf(latent(pixels, FlatCodec()), pixel_angle=1.0, **options)
    uv = np.random.default_rng(1).random((50, 2))
    up = np.repeat(DOWN, 50, 0)
    value = seen(rgb, bsdf, uv, up, up, 1000.0)
    np.testing.assert_allclose(value, np.tile(pixels.mean((0, 1)), (50, 1)), rtol=0.01)


def test_nearby_nothing_is_filtered(rgb: Any, pixels: Any) -> None:
    source = latent(pixels, FlatCodec())
    uv = np.random.default_rng(2).random((200, 2))
    up = np.repeat(DOWN, 200, 0)
    for interpolation in ("linear", "nearest"):
        options = {"interpolation": interpolation, "resolution": 2}
        plain, filtered = (
            texture_bsdf(source, **options, **more) for more in ({}, {"pixel_angle": 0.1})
        )
        found = seen(rgb, filtered, uv, up, up, 0.01)
        np.testing.assert_allclose(found, factors_at(rgb, plain, uv, up, up), atol=1e-3)


def test_by_chance_the_mean_is_that_over_the_footprint(rgb: Any, pixels: Any) -> None:
    bsdf = texture_bsdf(latent(pixels, FlatCodec()), pixel_angle=1.0, resolution=2)
    view = np.array([[0.0, np.sin(1.4), np.cos(1.4)]], np.float32)
    distance = 0.03125 / np.radians(1.0)  # half a texel across, 1.5 along
    uv = np.array([0.4, 0.5]) + np.random.default_rng(3).uniform(-1e-3, 1e-3, (20_000, 2))
    views, lights = np.repeat(view, len(uv), 0), np.repeat(DOWN, len(uv), 0)
    value = seen(rgb, bsdf, uv, lights, views, distance)
    length = 0.03125 / np.cos(1.4)
    along = 0.5 + length * (np.arange(2000) / 2000 - 0.5)
    line = np.stack([np.full(2000, 0.4), along], -1)
    plain = texture_bsdf(picture(pixels), interpolation="linear")
    up = np.repeat(DOWN, 2000, 0)
    expected = factors_at(rgb, plain, line, up, up).mean(0)
    np.testing.assert_allclose(value.mean(0), expected, atol=0.01)


def test_measurements_are_not_filtered(rgb: Any, pixels: Any) -> None:
    with pytest.raises(NacreError, match="pixel_angle filters encoded textures"):
        texture_bsdf(picture(pixels), pixel_angle=1.0)
