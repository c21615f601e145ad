"""Scattered samples: interpolation between them, and networks that train on them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nacre
from nacre.brdf import Brdf
from nacre.files import NacreError
from nacre.geometry import half_difference, half_vector, split
from nacre.measured import ScatteredBrdf
from nacre.measured.cleaning import from_measurement
from nacre.measured.interpolation import coordinates
from nacre.neural import Recipe, fit
from nacre.neural.scattered import hold_out, scattered_samples
from tests.data import list_data, require_data
from tests.measured.support import hemisphere, split_tensor
from tests.reflectances import Brushed

QUICK = Recipe(epochs=25)


class Gloss(Brdf):
    """A reddish base with a white highlight; not reciprocal: brighter for light from above."""

    def eval_components(self, wi, wo):
        lobe = np.maximum(half_vector(wi, wo)[2], 1e-9) ** 40.0
        return (0.2 + 0.1 * wi[2]) + lobe, 0.1 + lobe, 0.05 + lobe


def scan(truth: Brdf, count: int = 1500, seed: int = 0, **options: object) -> ScatteredBrdf:
    """Samples at directions up to 80 degrees from the normal."""
    random = np.random.default_rng(seed)
    wi, wo = hemisphere(random, 3 * count), hemisphere(random, 3 * count)
    high = (wi[:, 2] > 0.17) & (wo[:, 2] > 0.17)
    wi, wo = wi[high][:count], wo[high][:count]
    rgb = truth.eval(wi.astype(np.float64), wo)
    return ScatteredBrdf(wi, wo, rgb, "scan", isotropic=truth.isotropic, **options)


def median_error(truth: Brdf, other: Brdf) -> float:
    random = np.random.default_rng(9)
    wi, wo = hemisphere(random, 5000), hemisphere(random, 5000)
    high = (wi[:, 2] > 0.2) & (wo[:, 2] > 0.2)
    expected, got = (b.eval(wi[high], wo[high]) for b in (truth, other))
    return float(np.median(np.abs(got - expected) / expected))


def test_interpolation_passes_through_the_samples():
    brdf = scan(Gloss())
    samples = brdf.samples
    values = brdf.eval(samples.wi, samples.wo)
    assert values.dtype == np.float64
    np.testing.assert_allclose(values, samples.rgb, rtol=1e-3)
    np.testing.assert_array_equal(samples.cosine, samples.wi[:, 2])
    assert brdf.valid(samples.wi, samples.wo).mean() > 0.98
    np.testing.assert_array_equal(brdf.nearest(samples.wi, samples.wo), np.arange(len(samples)))


@pytest.mark.parametrize(("truth", "limit"), [(Gloss(), 0.01), (Brushed(), 0.1)])
def test_interpolation_resembles_what_was_sampled(truth, limit):
    assert median_error(truth, scan(truth)) < limit


def test_interpolation_is_exact_where_the_logarithm_is_a_plane():
    points = scan(Gloss(), 400)
    wi, wo = points.samples.wi, points.samples.wo
    random = np.random.default_rng(3)
    slopes = random.normal(0.0, 0.2, 4)

    def plane(wi, wo):
        f = np.exp(coordinates(split(wi), split(wo), True, True) @ slopes)
        return np.repeat(f[:, None], 3, axis=1)

    brdf = ScatteredBrdf(wi, wo, plane(wi, wo))
    middle = 0.5 * (wi[1:] + wi[:-1]), 0.5 * (wo[1:] + wo[:-1])
    middle = tuple(w / np.linalg.norm(w, axis=1, keepdims=True) for w in middle)
    error = np.abs(brdf.eval(*middle) / plane(*middle) - 1.0)
    assert np.quantile(error, 0.9) < 0.02


def test_values_stay_within_the_data_even_at_the_horizon():
    brdf = scan(Gloss(), 300)
    random = np.random.default_rng(4)
    wi, wo = hemisphere(random, 20_000), hemisphere(random, 20_000)
    wi[::2, 2] = wo[1::2, 2] = 1e-6
    values = brdf.eval(wi, wo)
    assert np.isfinite(values).all()
    assert (values <= brdf.samples.rgb.max(axis=0) * (1 + 1e-6)).all()
    assert (values >= brdf.samples.rgb.min(axis=0) * (1 - 1e-6)).all()
    assert not brdf.valid(wi[::2], wo[::2]).all()


def test_mirroring_is_a_choice_and_reciprocity_is_not_assumed():
    random = np.random.default_rng(5)
    wi, wo = (hemisphere(random, 500).astype(np.float64) for _ in range(2))
    flip = np.array([1.0, -1.0, 1.0])
    mirrored, plain = scan(Gloss()), scan(Gloss(), mirrored=False)
    np.testing.assert_allclose(mirrored.eval(wi, wo), mirrored.eval(wi * flip, wo * flip))
    assert (plain.eval(wi, wo) != plain.eval(wi * flip, wo * flip)).any()
    red, exchanged = mirrored.eval(wi, wo)[:, 0], mirrored.eval(wo, wi)[:, 0]
    tilted = np.abs(wi[:, 2] - wo[:, 2]) > 0.3
    assert ((red > exchanged) == (wi[:, 2] > wo[:, 2]))[tilted].mean() > 0.95


def test_an_anisotropic_scan_depends_on_the_azimuth():
    brdf = scan(Brushed())
    assert not brdf.mirrored
    wi = np.array([[0.5, 0.0, math.sqrt(0.75)], [0.0, 0.5, math.sqrt(0.75)]])
    across, along = brdf.eval(wi, [0.0, 0.0, 1.0])[:, 0]
    assert along > 1.5 * across


def test_few_samples_and_samples_of_one_kind_are_no_trouble():
    up = np.array([[0.0, 0.0, 1.0]])
    one = ScatteredBrdf(up, up, [[0.1, 0.2, -0.3]])
    random = np.random.default_rng(6)
    wi, wo = hemisphere(random, 100), hemisphere(random, 100)
    np.testing.assert_allclose(one.eval(wi, wo), np.tile([0.1, 0.2, 0.0], (100, 1)), atol=1e-6)
    same = ScatteredBrdf(wi, wo, np.full((100, 3), 0.25))
    np.testing.assert_allclose(same.eval(wo, wi), 0.25, rtol=1e-5)
    black = ScatteredBrdf(wi, wo, np.zeros((100, 3)))
    assert (black.eval(wo, wi) == 0.0).all()


def test_directions_that_are_not_numbers_do_not_raise():
    brdf = scan(Gloss(), 100)
    up = np.array([[0.0, 0.0, 1.0]])
    for other in ([np.nan] * 3, [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]):
        assert (brdf.eval(up, other) == 0.0).all()
        assert not brdf.valid(up, other).any()


def test_other_array_libraries_are_refused_with_the_fix():
    torch = pytest.importorskip("torch")
    brdf = scan(Gloss(), 100)
    tensor = split_tensor(torch.ones(4, 3))
    for call in (brdf.eval_components, brdf.valid_components):
        with pytest.raises(NacreError, match=r"scan: scattered samples .* fit a network"):
            call(tensor, tensor)


def test_wrong_arguments_are_refused():
    up = np.array([[0.0, 0.0, 1.0]])
    for wrong, words in [
        ((up, up, [[1.0, 2.0]]), "shapes"),
        ((up, np.zeros((2, 3)), up), "shapes"),
        ((np.zeros((0, 3)),) * 3, "at least one"),
        ((up, up, [[np.nan, 1.0, 1.0]]), "finite"),
        ((-up, up, up), "above the horizon"),
    ]:
        with pytest.raises(ValueError, match=words):
            ScatteredBrdf(*wrong)
    with pytest.raises(ValueError, match="together"):
        ScatteredBrdf(up, up, up, spectra=[[1.0]])
    with pytest.raises(ValueError, match="bands"):
        ScatteredBrdf(up, up, up, spectra=[[1.0]], wavelengths=[500.0, 600.0])


def test_rows_below_the_horizon_are_dropped_and_duplicates_averaged():
    random = np.random.default_rng(7)
    wi, wo = (hemisphere(random, 6).astype(np.float64) for _ in range(2))
    rgb = random.random((6, 3))
    rows = [0, 1, 2, 1, 3, 4, 1, 5]
    wi, wo, rgb = wi[rows], wo[rows], rgb[rows] + 0.1 * np.arange(8)[:, None]
    wi[2] *= -1.0
    rgb[5] = -1.0
    rgb[7, 2] = -0.01  # a colour outside the gamut
    brdf = from_measurement(wi, wo, rgb, "rows")
    facts = brdf.describe()
    assert facts["samples"] == 4
    assert facts["dropped below the horizon"] == 1
    assert facts["dropped as not measured"] == 1
    assert facts["averaged as duplicates"] == 2
    expected = np.stack([rgb[0], rgb[[1, 3, 6]].mean(axis=0), rgb[4], rgb[7]])
    np.testing.assert_allclose(brdf.samples.rgb, expected)
    np.testing.assert_allclose(brdf.samples.wi, wi[[0, 1, 4, 7]])
    with pytest.raises(ValueError, match="no sample"):
        from_measurement(-np.abs(wi), wo, rgb, "rows")


def test_parts_keep_their_spectra():
    random = np.random.default_rng(8)
    wi, wo = hemisphere(random, 50), hemisphere(random, 50)
    spectra = random.random((50, 4))
    whole = ScatteredBrdf(
        wi, wo, spectra[:, :3], spectra=spectra, wavelengths=[400.0, 500.0, 600.0, 700.0]
    )
    part = whole.subset(np.array([3, 1]))
    np.testing.assert_array_equal(part.spectra, spectra[[3, 1]])
    np.testing.assert_array_equal(part.wavelengths, whole.wavelengths)


# Fits


def test_a_network_fitted_to_a_scan_resembles_what_was_scanned():
    brdf = scan(Gloss())
    network = fit(brdf, QUICK)
    assert median_error(Gloss(), network) < 0.05
    assert network.metadata["fit"]["samples"] == 128_000
    kept, held = hold_out(len(brdf.samples), QUICK.held_out, QUICK.seed)
    assert len(held) == 300
    assert sorted([*kept, *held]) == list(range(1500))
    samples = brdf.samples[held]
    wi, wo, cosine = samples.wi, samples.wo, samples.cosine[:, None]
    loss = np.abs(np.log1p(network.eval(wi, wo) * cosine) - np.log1p(samples.rgb * cosine)).mean()
    assert network.metadata["quality"]["held_out_loss"] == pytest.approx(loss, rel=0.05)


def test_held_out_samples_are_neither_trained_on_nor_interpolated_from():
    brdf = scan(Gloss(), 500)
    _, held = hold_out(500, 0.2, 3)
    changed = brdf.samples.rgb.copy()
    changed[held] = 77.0
    other = ScatteredBrdf(brdf.samples.wi, brdf.samples.wo, changed, "scan")
    one, two = (scattered_samples(b, 8000, 0.2, 3) for b in (brdf, other))
    np.testing.assert_array_equal(one[0].blocks, two[0].blocks)
    assert (one[1].blocks != two[1].blocks).any()
    assert one[0].block_count == 500


def test_an_anisotropic_scan_fits():
    network = fit(scan(Brushed()), Recipe(epochs=10, samples=128_000))
    assert not network.isotropic
    assert median_error(Brushed(), network) < 0.25


def test_the_same_seed_gives_the_same_network():
    brdf = scan(Gloss(), 400)
    recipe = Recipe(epochs=2, samples=20_000)
    one, two = (fit(brdf, recipe).layers for _ in range(2))
    assert all((a.weights == b.weights).all() for a, b in zip(one, two, strict=True))


def test_too_few_samples_are_refused():
    with pytest.raises(NacreError, match="31 samples are too few"):
        fit(scan(Gloss(), 31), QUICK)
    fit(scan(Gloss(), 32), Recipe(epochs=1, samples=2000))


@pytest.mark.parametrize("name", list_data("cornell", "*.brdf") or ["garnet_red.brdf"])
def test_a_network_of_a_real_scan_stays_within_its_range_up_to_the_horizon(name):
    brdf = nacre.load(require_data("cornell", name))
    network = fit(brdf)
    random = np.random.default_rng(10)
    wi, wo = hemisphere(random, 100_000), hemisphere(random, 100_000)
    # Every angle of incidence; half of the pairs about the mirror direction, some grazing.
    wi[::4, 2] *= 0.01
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    wo[::2] = wi[::2] * [-1, -1, 1] + random.normal(0.0, 0.003, (50_000, 3))
    wo[:, 2] = np.maximum(wo[:, 2], 1e-6)
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    values = network.eval(wi, wo)
    assert np.isfinite(values).all()
    assert values.max() < 2.0 * brdf.samples.rgb.max()
    h, _ = half_difference(split(wi), split(wo))
    away = (h[2] < 0.9) & (np.minimum(wi[:, 2], wo[:, 2]) < 0.05)
    assert values[away].max() < brdf.samples.rgb.max() / 4


def test_a_network_of_a_real_scan_predicts_held_out_samples_better_than_their_neighbours():
    brdf = nacre.load(require_data("cornell", "garnet_red.brdf"))
    network = fit(brdf)
    kept, held = hold_out(len(brdf.samples), 0.2, 0)
    part, truth = brdf.subset(kept), brdf.samples[held]
    nearest = part.samples.rgb[part.nearest(truth.wi, truth.wo)]

    def error(values):
        return np.median(np.abs(values - truth.rgb) / truth.rgb)

    assert error(part.eval(truth.wi, truth.wo)) < error(nearest) / 2
    assert error(network.eval(truth.wi, truth.wo)) < error(nearest) / 1.3
