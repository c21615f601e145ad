"""Where a texture lies: texels against Mitsuba's bitmaps, directions against turned textures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.btf import TableBtf
from nacre.measured.textures import BONN
from nacre.mitsuba.textures.plugins import texture_bsdf

from .made import FLIP, factors_at, hemisphere, hits, picture, surface

UP = np.array([0.0, 0.0, 1.0], np.float32)


def transforms(mi: Any) -> dict[str, Any]:
    one = mi.ScalarTransform4f()
    return {
        "none": one,
        "scaled": one.scale([3.0, 2.0, 1.0]),
        "turned": one.translate([0.3, -0.2, 0.0]).rotate([0, 0, 1], 30.0).scale(1.7),
        "mirrored": one.scale([1.0, -1.0, 1.0]),
    }


@pytest.mark.parametrize("name", ["none", "scaled", "turned", "mirrored"])
def test_texels_lie_where_those_of_bitmaps_do(rgb: Any, name: str) -> None:
    random = np.random.default_rng(3)
    pixels = random.random((3, 5, 3)).astype(np.float32)
    to_uv = transforms(rgb)[name]
    uv = random.uniform(-1.5, 2.5, (500, 2)).astype(np.float32)
    up = np.tile(UP, (500, 1))
    for ours, theirs in (("linear", "bilinear"), ("nearest", "nearest")):
        bsdf = texture_bsdf(picture(pixels), interpolation=ours, to_uv=to_uv)
        found = factors_at(rgb, bsdf, uv, up, up)
        bitmap = rgb.load_dict(
            {
                "type": "bitmap",
                "bitmap": rgb.Bitmap(pixels),
                "raw": True,
                "filter_type": theirs,
                "accel": False,
                "wrap_mode": "repeat",
                "to_uv": to_uv,
            }
        )
        expected = np.array(bitmap.eval(hits(rgb, uv, up))).T
        assert np.quantile(np.abs(found - expected), 0.99) < 2e-3
        assert expected.std() > 0.1


def test_chance_gives_what_is_linear_between_texels(rgb: Any) -> None:
    pixels = np.random.default_rng(4).random((4, 3, 3)).astype(np.float32)
    centre = np.array([0.41, 0.97])  # between the last row and the first
    uv = centre + np.random.default_rng(5).uniform(-1e-3, 1e-3, (40_000, 2))
    up = np.tile(UP, (len(uv), 1))
    by_chance = factors_at(rgb, texture_bsdf(picture(pixels)), uv, up, up)
    linear = texture_bsdf(picture(pixels), interpolation="linear")
    expected = factors_at(rgb, linear, uv, up, up).mean(0)
    np.testing.assert_allclose(by_chance.mean(0), expected, atol=0.01)
    assert len(np.unique(by_chance.round(3), axis=0)) == 4


def test_a_texture_meets_itself_without_a_seam(rgb: Any) -> None:
    pixels = np.random.default_rng(6).random((4, 4, 3)).astype(np.float32)
    bsdf = texture_bsdf(picture(pixels), interpolation="linear")
    for axis in (0, 1):
        uv = np.full((200, 2), 0.3)
        uv[:, axis] = np.linspace(0.9, 1.1, 200)
        row = factors_at(rgb, bsdf, uv, *[np.tile(UP, (200, 1))] * 2)
        # Between texel centers it changes by at most 4 units of value per unit of uv.
        assert np.abs(np.diff(row, axis=0)).max() < 4.5 * 0.2 / 199


def directional() -> TableBtf:
    """Red tells the light's x, green its y and blue the view's x."""
    wi, wo = BONN.pairs()
    values = np.stack([wi[:, 0], wi[:, 1], wo[:, 0]], -1) * 0.4 + 0.5
    return TableBtf(values[None, None].astype(np.float32), wi, wo, "directional")


def test_directions_turn_with_the_texture(rgb: Any) -> None:
    btf, random = directional(), np.random.default_rng(7)
    wi, wo = (BONN.directions[random.integers(0, 151, 300)] for _ in range(2))
    uv = np.full((300, 2), 0.5)
    one = rgb.ScalarTransform4f()
    for to_uv, matrix in (
        (one, np.diag(FLIP)),
        (one.scale([2.0, -2.0, 1.0]), np.eye(3)),
        (one.scale([1.0, -1.0, 1.0]).rotate([0, 0, 1], 60.0), turn(60.0)),
    ):
        bsdf = texture_bsdf(btf, interpolation="linear", to_uv=to_uv)
        value = bsdf.eval(
            rgb.BSDFContext(), hits(rgb, uv, wo * FLIP), rgb.Vector3f(np.ascontiguousarray(wi.T))
        )
        found = np.pi * np.array(value).T / wi[:, 2:]
        local = wi @ matrix.T, wo @ matrix.T
        expected = np.stack([local[0][:, 0], local[0][:, 1], local[1][:, 0]], -1) * 0.4 + 0.5
        assert np.abs(found - expected).max() < 0.01


def turn(degrees: float) -> np.ndarray:
    """Rotation about z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_v_may_run_either_way(rgb: Any) -> None:
    wi, wo = hemisphere(200, 1, 0.5), hemisphere(200, 2, 0.5)
    bsdf = texture_bsdf(directional(), interpolation="linear")
    along, against = (hits(rgb, np.full((200, 2), 0.5), wo) for _ in range(2))
    expected = bsdf.eval(rgb.BSDFContext(), along, surface(rgb, wi))
    against.wi, against.dp_dv = surface(rgb, wo * FLIP), -against.sh_frame.t
    found = bsdf.eval(rgb.BSDFContext(), against, surface(rgb, wi * FLIP))
    np.testing.assert_allclose(np.array(found), np.array(expected), atol=1e-4)
