"""Pyramids of codes: boxes, what is averaged, and lookups between texels and levels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.btf import TableBtf
from nacre.errors import FormatError, NacreError
from nacre.measured.textures import UTIA
from nacre.textures import LatentMap
from nacre.textures.codecs import PUBLISHED, load_codec
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.mipmap import (
    FILTERS,
    LatentPyramid,
    box_weights,
    filtered_reflectance,
    halved_rows,
    level_shapes,
)
from nacre.workflows.encoding import encode
from tests.textures.codecs.networks.made import texture


class Squares(TexelCodec):
    """Reflectance factors that are squares of the one value of a code."""

    code_dim = 1

    def encoder(self, wi, wo):
        return lambda texels: np.sqrt(texels.mean((1, 2)))[:, None]

    def decoder(self, wi, wo):
        return lambda codes: np.broadcast_to(
            np.square(codes)[:, :, None], (len(codes), len(wi), 3)
        ).copy()


def latent(height: int, width: int, dtype: str = "f4") -> LatentMap:
    codes = np.random.default_rng(0).random((height, width, 1)).astype(dtype)
    return LatentMap(codes, Squares(), *UTIA.pairs(), "felt")


SIZES = [(1, 1), (8, 8), (5, 3), (7, 1), (1, 6), (13, 10)]


def test_shapes_of_levels():
    assert level_shapes(5, 3) == [(5, 3), (2, 1), (1, 1)]
    assert level_shapes(1, 6) == [(1, 6), (1, 3), (1, 1)]


@pytest.mark.parametrize("size", [1, 2, 3, 6, 7])
def test_boxes_cover_the_edge_evenly(size):
    weights = box_weights(size)
    count = max(1, size // 2)
    np.testing.assert_allclose(weights.sum(1), 1.0, atol=1e-6)
    np.testing.assert_allclose(weights.sum(0), count / size, atol=1e-6)
    fine = np.linspace(0.0, 1.0, 840, endpoint=False) + 1 / 1680  # a multiple of all edges
    pieces = np.equal.outer(np.arange(size), (fine * size).astype(int)).astype(float)
    for index, row in enumerate(weights):
        inside = (fine * count).astype(int) == index
        np.testing.assert_allclose(row, pieces[:, inside].mean(1), atol=1e-6)


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_means_are_those_of_what_is_averaged(height, width):
    made = latent(height, width)
    values = np.square(made.codes.astype(np.float64))
    for by, mean in (("codes", made.codes.mean()), ("reflectance", np.sqrt(values.mean()))):
        pyramid = LatentPyramid.build(made, by, pairs=3)
        shapes = [codes.shape[:2] for codes in pyramid.levels]
        assert shapes == level_shapes(height, width)
        np.testing.assert_array_equal(pyramid.levels[0], made.codes)
        for codes in pyramid.levels:
            found = codes if by == "codes" else np.square(codes)
            expected = mean if by == "codes" else mean**2
            assert found.mean(dtype=float) == pytest.approx(float(expected), rel=1e-5)
        assert pyramid.levels[-1].item() == pytest.approx(float(mean), rel=1e-5)


def test_even_sizes_are_means_of_four():
    made = latent(4, 6, "f2")
    (fine, coarse, _) = LatentPyramid.build(made, "codes").levels
    fours = made.codes.astype("f4").reshape(2, 2, 3, 2).mean((1, 3))
    np.testing.assert_allclose(coarse[..., 0], fours, rtol=1e-6)
    assert fine.dtype == np.float32
    directions = made.wi[:5], made.wo[:5]
    seen = filtered_reflectance(made, *directions)
    assert [level.shape for level in seen] == [(2, 3, 5, 3), (1, 1, 5, 3)]
    squares = np.square(made.codes.astype("f4")).reshape(2, 2, 3, 2).mean((1, 3))
    np.testing.assert_allclose(seen[0][..., 2, 1], squares, rtol=1e-5)


def test_rows_are_used_as_they_come():
    asked = []

    def rows():
        for y in range(6):
            asked.append(y)
            yield np.full((2, 1), float(y), np.float32)

    found = halved_rows(rows(), 6)
    assert next(found).item() == 0.5
    assert asked == [0, 1]
    assert [row.item() for row in found] == [2.5, 4.5]


def test_lookups_hit_texels_and_lie_between_them():
    pyramid = LatentPyramid.build(latent(4, 8), "codes")
    height, width = 4, 8
    y, x = np.divmod(np.arange(32), 8)
    uv = np.stack([(x + 0.5) / width, (y + 0.5) / height], 1)
    flat = pyramid.levels[0].reshape(-1, 1)
    np.testing.assert_allclose(pyramid(uv, np.zeros(32)), flat, atol=1e-6)
    np.testing.assert_allclose(pyramid(uv - [3.0, -2.0], np.full(32, -5.0)), flat, atol=1e-6)
    right = np.stack([(x + 1.0) / width, (y + 0.5) / height], 1)
    expected = (pyramid.levels[0] + np.roll(pyramid.levels[0], -1, 1)) / 2
    np.testing.assert_allclose(pyramid(right, np.zeros(32)), expected.reshape(-1, 1), atol=1e-6)
    corner = (flat[0] + flat[7] + flat[24] + flat[31]) / 4
    np.testing.assert_allclose(pyramid(np.zeros((1, 2)), np.zeros(1))[0], corner, atol=1e-6)
    # Between levels, at the center of a texel of the coarser one.
    place = np.array([[0.125, 0.25]])
    fine, coarse = pyramid.levels[0][:2, :2].mean(), pyramid.levels[1][0, 0].item()
    assert fine == pytest.approx(coarse, rel=1e-6)
    wide, all_ = pyramid.levels[2][0, 0].item(), pyramid.levels[3].item()
    found = pyramid(np.array([[0.25, 0.5]]), np.array([2.25])).item()
    assert found == pytest.approx(0.75 * wide + 0.25 * all_, rel=1e-6)
    assert pyramid(place, np.array([9.0])).item() == pytest.approx(all_, rel=1e-6)
    mixed = pyramid(np.repeat(place, 3, 0), np.array([1.0, 3.0, 0.0]))
    np.testing.assert_allclose(mixed[:, 0], [coarse, all_, fine], atol=1e-6)


def test_a_plane_is_looked_up_exactly_inside():
    v, u = np.meshgrid((np.arange(16) + 0.5) / 16, (np.arange(16) + 0.5) / 16, indexing="ij")
    codes = (3.0 * u - 2.0 * v)[..., None].astype(np.float32)
    made = LatentMap(codes, Squares(), *UTIA.pairs())
    pyramid = LatentPyramid.build(made, "codes")
    random = np.random.default_rng(0)
    uv, level = 0.25 + 0.5 * random.random((50, 2)), 2.0 * random.random(50)
    found = pyramid(uv, level)[:, 0]
    np.testing.assert_allclose(found, 3.0 * uv[:, 0] - 2.0 * uv[:, 1], atol=1e-5)


class Roots(Squares):
    """The same, filtered by its codes."""

    filtered_by = "codes"


@pytest.mark.parametrize(("codec", "by"), [(Squares(), "reflectance"), (Roots(), "codes")])
def test_the_codec_says_what_is_averaged(codec, by):
    made = replace(latent(8, 8), codec=codec)
    chosen = LatentPyramid.build(made, pairs=3).levels
    for other in FILTERS:
        levels = LatentPyramid.build(made, other, pairs=3).levels
        same = [np.array_equal(a, b) for a, b in zip(chosen, levels, strict=True)]
        assert same == [True] + [other == by] * 3


def test_the_default_is_closer_to_what_is_seen_from_afar():
    made = texture(3, 8)
    dark = np.where(np.indices((8, 8)).sum(0) % 2, 1.0, 0.05)[..., None, None]
    btf = TableBtf(made.values * dark.astype(np.float32), made.wi, made.wo)
    codec = load_codec(PUBLISHED)
    coded = LatentMap(encode(btf, codec).codes, codec, btf.wi, btf.wo)
    decode = codec.decoder(btf.wi, btf.wo)
    errors = {}
    for by in FILTERS:
        levels = LatentPyramid.build(coded, by, pairs=64).levels[1:]
        found = [decode(codes.reshape(-1, codec.code_dim)) for codes in levels]
        truths = filtered_reflectance(coded, btf.wi, btf.wo)
        pairs = zip(found, truths, strict=True)
        errors[by] = sum(np.square(a.reshape(b.shape) - b).mean() for a, b in pairs)
    (other,) = (by for by in FILTERS if by != codec.filtered_by)
    assert errors[codec.filtered_by] < 0.5 * errors[other]


def test_networks_of_fixed_directions_are_filtered_too():
    pytest.importorskip("torch", reason="needs the extra 'btf'")
    from nacre.textures.codecs.networks import CustomNetwork, CustomSettings, Whitening

    btf = texture(0)
    network = CustomNetwork(btf.wi, btf.wo, CustomSettings(latent=2), Whitening(-1.0, 0.5))
    made = LatentMap(encode(btf, network).codes, network, btf.wi, btf.wo)
    last = LatentPyramid.build(made).levels[-1]
    np.testing.assert_allclose(last[0, 0], made.codes.astype("f4").mean((0, 1)), rtol=1e-4)
    with pytest.raises(NacreError, match="at its own 225 pairs of directions only"):
        LatentPyramid.build(made, "reflectance", pairs=9)


def test_a_single_texel_has_one_level():
    pyramid = LatentPyramid.build(latent(1, 1))
    assert len(pyramid.levels) == 1
    found = pyramid(np.array([[0.3, 7.0]]), np.array([4.0]))
    np.testing.assert_allclose(found, pyramid.levels[0][0])


def test_what_is_wrong_is_named():
    made = latent(4, 4)
    with pytest.raises(ValueError, match="by is one of reflectance, codes, not 'median'"):
        LatentPyramid.build(made, "median")  # type: ignore[arg-type]
    made.codes[1, 2] = np.nan
    for by in ("codes", "reflectance"):
        with pytest.raises(FormatError, match="felt: some filtered codes are not finite"):
            LatentPyramid.build(made, by)  # type: ignore[arg-type]
    codes = np.zeros((4, 4, 2), np.float32)
    for levels in ((), (codes,), (codes, codes[:2, :2], codes[:1, :1, :1])):
        with pytest.raises(ValueError, match="levels are"):
            LatentPyramid(levels)
