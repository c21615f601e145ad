"""Principal components of texels against eigenvalues of data that are written out."""

from __future__ import annotations

import itertools
from functools import partial

import numpy as np
import pytest

from nacre.btf import TableBtf
from nacre.errors import NacreError
from nacre.measured.textures import BONN
from nacre.measured.textures.domes import below, pairs
from nacre.textures.codecs.principal import PcaCodec, PcaRecipe, find_components
from nacre.textures.codecs.symmetry import symmetric_rotations
from tests.textures.support import ByImage

RING = pairs(*[BONN.directions[below(BONN.directions, 12.0)]] * 2)
"""7 directions for light and viewer each: 49 pairs that six turns map onto themselves."""
VALUES = 9


def texture(seed: int, size: int = 5) -> TableBtf:
    """Texels of a few random patterns in colors of their own, and noise."""
    random = np.random.default_rng(seed)
    wi, wo = RING
    patterns = random.random((4, len(wi)))
    colors = random.random((size * size, 4, 1, 3))
    values = (colors * patterns[:, :, None]).sum(1) * random.uniform(0.05, 1.0, (size**2, 1, 1))
    values += 0.01 * random.random(values.shape)
    return TableBtf(values.reshape(size, size, -1, 3).astype(np.float32), wi, wo, f"made {seed}")


TEXTURES = [partial(texture, seed) for seed in range(3)]


def written_out() -> tuple[np.ndarray, np.ndarray]:
    """Every texel in every order of channels and turn, shape (rows, 3 n), and its weight."""
    texels = np.concatenate([t().texels(slice(None)) for t in TEXTURES]).astype(np.float64)
    weights = 1.0 / (texels.mean((1, 2)) + 0.01)
    channels = list(itertools.permutations(range(3)))
    turns = symmetric_rotations(*RING)
    rows = [texels[:, t][:, :, c].reshape(len(texels), -1) for c in channels for t in turns]
    return np.concatenate(rows), np.tile(weights, len(rows))


def test_components_are_eigenvectors_of_data_written_out():
    codec = find_components(TEXTURES, PcaRecipe(VALUES))
    rows, weights = written_out()
    weights = weights / weights.mean()
    mean = weights @ rows / weights.sum()
    scaled = (rows - mean) * np.sqrt(weights)[:, None]
    exact = np.linalg.eigvalsh(scaled.T @ scaled / len(rows))[::-1]
    np.testing.assert_allclose(codec.mean.reshape(-1), mean, atol=1e-5)
    np.testing.assert_allclose(codec.variances, exact[:VALUES], rtol=1e-3)
    flat = codec.components.reshape(VALUES, -1).astype(np.float64)
    np.testing.assert_allclose(flat @ flat.T, np.eye(VALUES), atol=1e-4)
    kept = np.square(scaled @ flat.T).mean(0)
    np.testing.assert_allclose(kept, exact[:VALUES], rtol=1e-3)
    left = exact[VALUES:].sum() / rows.shape[1]
    assert codec.noise == pytest.approx(left, rel=2e-3, abs=1e-7)


def test_fewer_pairs_give_least_squares_with_the_variances():
    codec = find_components(TEXTURES, PcaRecipe(VALUES))
    texels = TEXTURES[0]().texels(slice(0, 6))
    rows = np.random.default_rng(0).permutation(len(RING[0]))[:12]
    codes = codec.encoder(RING[0][rows], RING[1][rows])(texels[:, rows])
    columns = codec.components[:, rows].reshape(VALUES, -1).T.astype(np.float64)
    penalty = np.diag(np.sqrt(codec.noise / codec.variances))
    goal = (texels[:, rows] - codec.mean[rows]).reshape(len(texels), -1)
    stacked = np.concatenate([columns, penalty])
    wanted = np.concatenate([goal.T, np.zeros((VALUES, len(texels)))])
    expected = np.linalg.lstsq(stacked, wanted, rcond=None)[0].T
    np.testing.assert_allclose(codes, expected, rtol=1e-3, atol=1e-3)
    some = codec.decoder(RING[0][rows[:3]], RING[1][rows[:3]])(codes)
    np.testing.assert_allclose(some, codec.decoder(*RING)(codes)[:, rows[:3]], atol=1e-6)


def test_the_strongest_components_are_a_codec_of_their_own():
    whole = find_components(TEXTURES, PcaRecipe(VALUES))
    fewer, same = whole.first(4), find_components(TEXTURES, PcaRecipe(4))
    assert fewer.code_dim == 4
    assert fewer.noise == pytest.approx(same.noise, rel=1e-2)
    np.testing.assert_allclose(fewer.variances, same.variances, rtol=1e-3)
    with pytest.raises(NacreError, match="there are only 9 principal components"):
        whole.first(10)


def test_little_memory_takes_fewer_texels():
    codec = find_components(TEXTURES, PcaRecipe(4, memory=12 * len(RING[0]) * 3 * 7))
    assert codec.metadata["texels"] == 21
    assert codec.metadata["materials"] == ["made 0", "made 1", "made 2"]


def test_images_are_read_once(monkeypatch):
    monkeypatch.setattr("nacre.textures.codecs.principal.analysis._BLOCK", 12 * 49 * 4)
    images = ByImage(texture(0))
    codec = find_components([lambda: images], PcaRecipe(4))
    assert sorted(images.read) == list(range(49))
    plain = find_components(TEXTURES[:1], PcaRecipe(4))
    np.testing.assert_allclose(codec.mean, plain.mean, rtol=1e-3)
    np.testing.assert_allclose(codec.variances, plain.variances, rtol=5e-3)


def test_other_directions_are_refused():
    codec = find_components(TEXTURES[:1], PcaRecipe(4))
    others = pairs(*[BONN.directions[below(BONN.directions, 30.0)]] * 2)
    for make in (codec.encoder, codec.decoder):
        with pytest.raises(NacreError, match="49 pairs of directions only, 912 of 961 are others"):
            make(*others)
    small = texture(0)
    fewer = TableBtf(small.values[:, :, :20], small.wi[:20], small.wo[:20], "fewer")
    with pytest.raises(NacreError, match="fewer: is not measured at the directions of made 0"):
        find_components([TEXTURES[0], lambda: fewer], PcaRecipe(4))


def test_too_few_texels_and_bad_sizes_are_refused():
    with pytest.raises(NacreError, match="25 texels are too few for 32"):
        find_components(TEXTURES[:1], PcaRecipe(32))
    six = texture(0)
    six = TableBtf(six.values[:, :, :6], six.wi[:6], six.wo[:6], "six")
    with pytest.raises(NacreError, match="6 pairs of directions are too few for 19"):
        find_components([lambda: six], PcaRecipe(19))
    assert find_components([lambda: six], PcaRecipe(19), min_count=4).code_dim == 18
    assert find_components(TEXTURES[:1], PcaRecipe(32), min_count=25).code_dim == 25
    with pytest.raises(ValueError, match="code_dim must be positive"):
        PcaRecipe(0)
    codec = find_components(TEXTURES[:1], PcaRecipe(4))
    with pytest.raises(ValueError, match="components have shape"):
        PcaCodec(codec.wi, codec.wo, codec.mean, codec.components[:, :9], codec.variances, 1.0)
