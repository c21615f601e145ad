"""Interpolation between measured directions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.btf import TableBtf
from nacre.errors import NacreError
from nacre.measured.textures import BONN
from nacre.mitsuba.textures.hemisphere import Hemisphere
from nacre.mitsuba.textures.plugins import texture_bsdf

from .made import factors_at, hemisphere


def test_weights_are_barycentric_on_the_sphere(rgb: Any) -> None:
    directions, w = BONN.directions, hemisphere(3000, 1, np.cos(np.radians(73.0)))
    corners = Hemisphere(rgb, directions, stochastic=False).around(
        tuple(rgb.Vector3f(np.ascontiguousarray(w.T)))
    )
    index = np.array([np.array(i) for i, _ in corners])
    weight = np.array([np.array(v) for _, v in corners])
    np.testing.assert_allclose(weight.sum(0), 1.0, atol=1e-5)
    assert weight.min() >= 0.0
    mean = (weight[..., None] * directions[index]).sum(0)
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    np.testing.assert_allclose(mean, w, atol=1e-4)
    # Delaunay: no direction is nearer to the center of a triangle than its corners are.
    a, b, c = directions[index].astype(np.float64)
    centre = np.cross(b - a, c - a)
    centre *= np.sign((centre * a).sum(1, keepdims=True))
    centre /= np.linalg.norm(centre, axis=1, keepdims=True)
    assert ((centre @ directions.T).max(1) <= (centre * a).sum(1) + 1e-5).all()


def test_directions_beyond_all_have_weights_of_an_edge(rgb: Any) -> None:
    w = hemisphere(500, 2, 0.0)
    w = w[w[:, 2] < 0.2]
    corners = Hemisphere(rgb, BONN.directions, stochastic=False).around(
        tuple(rgb.Vector3f(np.ascontiguousarray(w.T)))
    )
    index = np.array([np.array(i) for i, _ in corners])
    weight = np.array([np.array(v) for _, v in corners])
    np.testing.assert_allclose(weight.sum(0), 1.0, atol=1e-5)
    used = (weight[..., None] * BONN.directions[index]).sum(0)
    azimuths = [np.arctan2(v[:, 1], v[:, 0]) for v in (w, used)]
    apart = np.abs((azimuths[0] - azimuths[1] + np.pi) % (2 * np.pi) - np.pi)
    assert np.degrees(apart.max()) < 15.0  # the spacing of the outermost ring


def table(order: Any = slice(None)) -> TableBtf:
    wi, wo = BONN.pairs()
    values = np.random.default_rng(3).random((2, 3, len(wi), 3)).astype(np.float32)
    return TableBtf(values[:, :, order], wi[order], wo[order], "noise")


def test_measured_pairs_have_their_values(rgb: Any) -> None:
    random, btf = np.random.default_rng(4), table()
    pairs, texels = random.integers(0, btf.pair_count, 500), random.integers(0, 6, 500)
    uv = np.stack([(texels % 3 + 0.5) / 3, (texels // 3 + 0.5) / 2], -1)
    expected = btf.texels(texels)[np.arange(500), pairs]
    scrambled = table(np.random.default_rng(5).permutation(btf.pair_count))
    for source in (btf, scrambled):
        bsdf = texture_bsdf(source, interpolation="linear")
        found = factors_at(rgb, bsdf, uv, btf.wi[pairs], btf.wo[pairs])
        np.testing.assert_allclose(found, expected, atol=2e-3)


def test_tables_that_cannot_be_interpolated_are_refused(rgb: Any) -> None:
    few = np.arange(BONN.pairs()[0].shape[0]) != 7
    with pytest.raises(NacreError, match=r"noise: not every light.*encode it"):
        texture_bsdf(table(few))
    with pytest.raises(NacreError, match=r"its table needs 1 MiB, 1 are allowed|MiB"):
        texture_bsdf(table(), memory=1)
    wi = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]], np.float32)
    pairs = TableBtf(np.ones((1, 1, 4, 3)), np.tile(wi, (2, 1)), np.repeat(wi, 2, 0), "few")
    with pytest.raises(NacreError, match="2 directions span no triangles"):
        texture_bsdf(pairs)
