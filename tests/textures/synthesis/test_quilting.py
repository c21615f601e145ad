"""Patches: where they are taken from, how they are cut, and what comes of them."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.measured.textures import UTIA
from nacre.textures import LatentMap
from nacre.textures.synthesis import synthesize
from nacre.textures.synthesis.patches import PatchSearch, inside_cuts, minimum_error_cut
from nacre.textures.synthesis.quilted_map import texel_features
from nacre.textures.synthesis.quilting import Quilting, quilt
from nacre.textures.synthesis.seams import overlap_of, patch_size, seam_contrast, seams, tiles
from tests.textures.codecs.basis.made import codec


def smooth(height: int, width: int, values: int = 2, seed: int = 0) -> np.ndarray:
    """Random waves that tile, with details of about four texels; means zero."""
    random = np.random.default_rng(seed)
    spectrum = np.fft.fft2(random.normal(size=(height, width, values)), axes=(0, 1))
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.fftfreq(width))
    spectrum *= np.exp(-((frequency / 0.12) ** 2))[..., None]
    waves = np.fft.ifft2(spectrum, axes=(0, 1)).real
    waves -= waves.mean((0, 1))
    return (waves / waves.std((0, 1))).astype(np.float32)


def latent(height: int = 24, width: int = 28, seed: int = 0, dtype: str = "f2") -> LatentMap:
    codes = smooth(height, width, 2, seed).astype(dtype)
    return LatentMap(codes, codec(), *UTIA.pairs(), "felt")


@pytest.mark.parametrize("seed", range(3))
def test_a_cut_is_the_best_of_all_paths(seed):
    errors = np.random.default_rng(seed).random((5, 4))
    path = minimum_error_cut(errors)
    paths = [
        steps
        for steps in itertools.product(range(4), repeat=5)
        if all(abs(a - b) <= 1 for a, b in itertools.pairwise(steps))
    ]
    least = min(paths, key=lambda steps: errors[range(5), steps].sum())
    assert tuple(path) == least


def test_cuts_of_all_sides_run_where_old_and_new_agree():
    new = np.zeros((12, 12, 1), np.float32)
    old = np.ones_like(new)
    old[:, 2] = old[:, 9] = old[1] = old[10] = 0.0  # where the last texel before each cut is
    inside = inside_cuts(old, new, 3, 3, 4, 4)
    expected = np.zeros((12, 12), bool)
    expected[2:10, 3:9] = True
    middle = slice(4, 8)  # in the corners cuts may turn off where both agree
    np.testing.assert_array_equal(inside[middle], expected[middle])
    np.testing.assert_array_equal(inside[:, middle], expected[:, middle])
    np.testing.assert_array_equal(inside_cuts(old, new, 0, 0, 0, 0), True)


@pytest.mark.parametrize("periodic", [False, True])
def test_the_search_is_the_sum_of_squares_at_every_position(periodic):
    random = np.random.default_rng(1)
    features = random.normal(size=(9, 11, 3)).astype(np.float32)
    given = random.normal(size=(4, 4, 3)).astype(np.float32)
    known = random.random((4, 4)) < 0.6
    found = PatchSearch(features, 4, periodic).errors(given, known)
    assert found.shape == ((9, 11) if periodic else (6, 8))
    around = np.arange(4)
    for y, x in np.ndindex(found.shape):
        patch = features[np.ix_((y + around) % 9, (x + around) % 11)]
        expected = (np.square(patch - given).sum(-1) * known).sum()
        assert found[y, x] == pytest.approx(expected, rel=1e-6)


def test_distances_of_appearance_are_those_of_roots_of_reflectance():
    made = latent(8, 8)
    found = texel_features(made).reshape(64, -1)
    roots = made.codec.embedding(made.wi, made.wo)(made.codes.reshape(64, 2))
    assert np.abs(found.mean(0)).max() < 1e-5
    a, b = np.triu_indices(64, 1)
    expected = np.square(roots[a] - roots[b]).sum(1)
    distances = np.square(found[a] - found[b]).sum(1)
    assert (distances <= expected * (1.0 + 1e-4)).all()
    assert distances.sum() >= 0.985 * expected.sum()
    assert texel_features(made, max_count=1).shape == (8, 8, 1)


@pytest.mark.parametrize("tile", [False, True])
@pytest.mark.parametrize(("height", "width"), [(50, 41), (9, 64), (8, 8)])
def test_every_texel_comes_from_the_input_and_the_seed_decides(height, width, tile):
    features = smooth(24, 28)
    settings = Quilting(8, 3, tile=tile, seed=5)
    sources = quilt(features, height, width, settings)
    assert sources.shape == (height, width)
    assert sources.min() >= 0
    assert sources.max() < 24 * 28
    np.testing.assert_array_equal(sources, quilt(features, height, width, settings))
    other = quilt(features, height, width, replace(settings, seed=6))
    assert (sources != other).any()


def test_patches_without_a_seam_are_runs_of_the_input():
    sources = np.arange(12 * 10).reshape(12, 10)
    for edges in seams(sources, 12, 10, periodic=True, tile=True):
        assert not edges.any()
    across, down = seams(sources, 12, 10, periodic=False, tile=True)
    assert across[:, -1].all()
    assert not across[:, :-1].any()
    assert down[-1].all()
    across, down = seams(sources, 12, 10, periodic=False, tile=False)
    assert not across.any() | down.any()
    moved = sources.copy()
    moved[:, 4:] = np.roll(sources, -3, 1)[:, 4:]
    across, _ = seams(moved, 12, 10, periodic=True, tile=False)
    assert across[:, 3].all()
    assert across.sum() == 12


def test_contrast_is_a_ratio_of_root_mean_squares():
    values = np.zeros((4, 6, 1), np.float32)
    values[:, :3, 0] = [0.0, 1.0, 2.0]
    values[:, 3:, 0] = [5.0, 6.0, 7.0]  # a step of 3 among steps of 1, and none downwards
    across, down = np.zeros((4, 6), bool), np.zeros((4, 6), bool)
    across[:, 2] = True
    found = seam_contrast(values, (across, down), tile=False)
    assert found.ratio == pytest.approx(3.0 / np.sqrt(16.0 / 34.0))
    assert found.fraction == pytest.approx(4 / 38)
    assert seam_contrast(values, (down, down), tile=False).ratio is None


@pytest.mark.parametrize("periodic", [False, True])
def test_seams_are_weaker_than_those_of_random_patches(periodic):
    features = smooth(48, 48)
    cut = quilt(features, 96, 96, Quilting(16, 6, periodic=periodic, tile=True))
    random = np.random.default_rng(0)
    naive = np.empty((96, 96), np.intp)
    around = np.arange(16)
    for y, x in itertools.product(range(0, 96, 16), repeat=2):
        top, left = random.integers(0, 33, 2)
        naive[y : y + 16, x : x + 16] = (top + around)[:, None] * 48 + left + around

    def ratio(sources):
        edges = seams(sources, 48, 48, periodic=periodic, tile=True)
        found = seam_contrast(features.reshape(-1, 2)[sources], edges, tile=True).ratio
        assert found is not None
        return found

    assert ratio(naive) > 2.5
    assert ratio(cut) < 0.65 * ratio(naive)
    border = np.zeros((96, 96), bool)
    border[:, -1] = True
    edges = border, np.zeros_like(border)
    wrapped = seam_contrast(features.reshape(-1, 2)[cut], edges, tile=True).ratio
    assert wrapped is not None
    assert wrapped < 0.65 * ratio(naive)


def test_a_texture_tells_how_it_should_be_laid():
    features = smooth(64, 64)
    assert tiles(features)
    assert not tiles(features[:50, :50])
    assert 8 <= patch_size(features) <= 32
    assert patch_size(smooth(64, 64)[::2, ::2]) <= patch_size(features)
    stretched = features[:, :32].repeat(2, 1).repeat(2, 0)
    assert patch_size(stretched) > patch_size(features)
    assert patch_size(np.zeros((6, 7, 1), np.float32)) == 3
    assert [overlap_of(n) for n in (2, 8, 32)] == [1, 3, 12]


def test_codes_are_copied_bit_by_bit():
    made = latent()
    found = synthesize(made, 40, 33, tile=True, seed=3)
    codes = made.codes.reshape(-1, 2)
    np.testing.assert_array_equal(found.latent.codes, codes[found.sources])
    assert found.latent.codes.dtype == np.float16
    facts = found.facts()
    assert facts["output tiles"]
    assert facts["input tiles"]
    assert facts["share of the input used"] == len(np.unique(found.sources)) / len(codes)
    assert 0.0 < facts["share of neighbors with a seam between"] < 0.5
    assert synthesize(made, 40, 33, periodic=False).settings.periodic is False


@pytest.mark.parametrize(
    ("size", "options", "message"),
    [
        ((0, 10), {}, r"has 2 x 2 to 16,777,216 texels, not 10 x 0"),
        ((1 << 13, 1 << 13), {}, "not 8,192 x 8,192"),
        ((40, 40), {"patch": 25}, r"larger than the input \(28 x 24\) .* 24 at most"),
        ((10, 40), {"patch": 12}, r"the output \(40 x 10\); 10 at most"),
        ((40, 40), {"patch": 8, "overlap": 5}, "patches of 8 overlap by 1 to 4 texels, not 5"),
        ((40, 40), {"patch": 1}, "at least 2 texels per edge, not 1"),
        ((40, 40), {"overlap": 13}, "patches of 24 overlap by 1 to 12 texels, not 13"),
        ((40, 40), {"tolerance": float("nan")}, "the tolerance is a number from 0, not nan"),
    ],
)
def test_what_cannot_be_is_named(size, options, message):
    with pytest.raises(NacreError, match=message):
        synthesize(latent(), *size, **options)


def test_bad_maps_are_named():
    with pytest.raises(NacreError, match="28 x 1 texels are too few for patches"):
        synthesize(latent(1), 8, 8)
    made = latent()
    made.codes[3, 4] = np.nan
    with pytest.raises(FormatError, match="felt: some codes decode to values that are not finite"):
        synthesize(made, 40, 40)
