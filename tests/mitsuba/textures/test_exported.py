"""Exported textures against the plugin that renders them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.textures.relief import Relief
from nacre.targets.textures import TextureAtlas
from tests.oracles.textures import Points, TextureTruth
from tests.targets.made_texture import (
    HEIGHT,
    NAME,
    RESOLUTION,
    WIDTH,
    atlas,
    heights,
    texture,
)

from .made import factors_at, hemisphere, hits, surface

COUNT = 400
OPTIONS = {"interpolation": "linear", "resolution": RESOLUTION}


@pytest.fixture(scope="module")
def truth() -> TextureTruth:
    return TextureTruth(atlas().files(NAME), NAME, HEIGHT, WIDTH)


def test_texels_and_what_is_between_them(rgb: Any, truth: TextureTruth) -> None:
    uv = np.random.default_rng(0).random((COUNT, 2)).astype(np.float32)
    wi, wo = hemisphere(COUNT, 1, 0.02), hemisphere(COUNT, 2, 0.02)
    bsdf = texture_bsdf(texture(), **OPTIONS)
    expected = factors_at(rgb, bsdf, uv, wi, wo) / np.pi
    found = truth.evaluate(Points(uv, np.zeros(COUNT, np.float32), wi, wo))
    np.testing.assert_allclose(found, expected, rtol=5e-4, atol=1e-4)
    density = np.array(bsdf.pdf(rgb.BSDFContext(), hits(rgb, uv, wo), surface(rgb, wi)))
    level = np.zeros(COUNT, np.float32)
    np.testing.assert_allclose(truth.pdf(Points(uv, level, wi, wo)), density, rtol=1e-3, atol=1e-4)


def test_levels_and_what_is_between_them(rgb: Any, truth: TextureTruth) -> None:
    uv = np.random.default_rng(0).random((COUNT, 2)).astype(np.float32)
    wi, up = hemisphere(COUNT, 1, 0.02), np.tile(np.float32([0.0, 0.0, 1.0]), (COUNT, 1))
    level = np.linspace(-1.0, 4.0, COUNT, dtype=np.float32)
    si = hits(rgb, uv, up)
    si.t = rgb.Float(2.0**level / np.radians(1.0) / WIDTH)
    bsdf = texture_bsdf(texture(), pixel_angle=1.0, **OPTIONS)
    value = np.array(bsdf.eval(rgb.BSDFContext(), si, surface(rgb, wi))).T / wi[:, 2:]
    found = truth.evaluate(Points(uv, level, wi, up))
    np.testing.assert_allclose(found, value, rtol=5e-4, atol=1e-4)


def test_heights(rgb: Any) -> None:
    field = heights()
    found = TextureTruth(atlas().files(NAME), NAME, HEIGHT, WIDTH)
    uv = np.random.default_rng(3).random((COUNT, 2)).astype(np.float32)
    wo = hemisphere(COUNT, 4, 0.02)
    relief = Relief(rgb, field.heights, field.depth, WIDTH / HEIGHT)
    view = rgb.Vector3f(wo.T)
    seen = np.array(relief.seen(rgb.Point2f(uv.T), tuple(view))).T
    level = np.zeros(COUNT, np.float32)
    away = np.abs(found.parallax(Points(uv, level, wo, wo)) - seen).max(1)
    assert np.quantile(away, 0.98) < 3e-4  # half floats; a ray may graze a hill


def test_an_atlas_without_heights_has_none() -> None:
    plain = TextureAtlas(HEIGHT, WIDTH, atlas().weights, atlas().functions, atlas().lobes)
    assert f"{NAME}_heights.ktx2" in atlas().files(NAME)
    assert f"{NAME}_heights.ktx2" not in plain.files(NAME)
