"""Networks that train on scattered samples."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre.errors import NacreError
from nacre.measured import ScatteredBrdf
from nacre.neural import Recipe, fit
from nacre.neural.augmentation import augmentation
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.scattered import clamped, hold_out, relative_errors, scattered_samples
from nacre.neural.training import initial_layers
from tests.data import list_data, require_data
from tests.reflectances import Brushed
from tests.scans import AWKWARD, Gloss, awkward, everywhere, median_error, scan
from tests.tiers import tiered

QUICK = Recipe(epochs=10)


def test_squares_that_no_layer_could_clamp_are_refused():
    with pytest.raises(NacreError, match="have ReLUs"):
        fit(scan(Gloss(), 400), Recipe(epochs=1, activation="squared relu"))


def test_a_network_fitted_to_a_scan_resembles_what_was_scanned():
    brdf = scan(Gloss())
    network = fit(brdf, QUICK)
    assert median_error(Gloss(), network) < 0.05
    assert network.metadata["fit"]["samples"] == 320_000
    assert (network.inputs, network.precision) == ("paper", "single")
    kept, held = hold_out(len(brdf.samples), QUICK.held_out, QUICK.seed)
    assert len(held) == 300
    assert sorted([*kept, *held]) == list(range(1500))
    samples = brdf.samples[held]
    wi, wo, cosine = samples.wi, samples.wo, samples.cosine[:, None]
    loss = np.abs(np.log1p(network.eval(wi, wo) * cosine) - np.log1p(samples.rgb * cosine)).mean()
    assert network.metadata["quality"]["held_out_loss"] == pytest.approx(loss, rel=0.05)


def test_a_network_of_a_scan_keeps_its_bound_and_so_its_precision():
    brdf = scan(Gloss())
    network = fit(brdf, Recipe(epochs=2, samples=8000, inputs="enhanced", size=1000))
    assert network.precision == network.metadata["fit"]["precision"] == "single"
    hidden = network.metadata["fit"]["hidden"]
    assert hidden == list(Recipe(inputs="paper", size=1000).widths(6))
    assert network.eval(*everywhere()).max() <= brdf.samples.rgb.max() * (1 + 1e-6)


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


@pytest.mark.parametrize("name", [name for name in AWKWARD if name not in ("1", "3")])
def test_a_fit_to_awkward_samples_is_finite_and_no_higher_than_they_are(name):
    brdf = awkward(name)
    network = fit(brdf, Recipe(epochs=3, samples=4000))
    values = network.eval(*everywhere())
    assert np.isfinite(values).all()
    assert (values <= brdf.samples.rgb.max(axis=0) * (1 + 1e-5)).all()


@pytest.mark.parametrize("name", ["1", "3"])
def test_a_handful_of_samples_is_refused(name):
    with pytest.raises(NacreError, match=rf"^{name}: {name} samples are too few .* at least 10$"):
        fit(awkward(name))


def test_filling_reaches_the_horizon_and_is_the_interpolation():
    brdf = scan(Gloss(), 200)
    calls = []
    filled = augmentation(brdf, 30_000, 0, lambda *call: calls.append(call))
    assert len(filled) == 30_000
    assert calls[-1] == (30_000, 30_000)
    np.testing.assert_array_equal(filled.rgb, brdf.eval(filled.wi, filled.wo))
    for w in (filled.wi, filled.wo):
        np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0)
        assert w[:, 2].min() > 0.0
        assert (w[:, 2] < np.cos(np.radians(89.0))).sum() > 200
    np.testing.assert_array_equal(augmentation(brdf, 500, 3).wi, augmentation(brdf, 500, 3).wi)


def test_a_bounded_network_is_the_lower_of_its_value_and_the_bound():
    layers = initial_layers((21, 21), 1)
    free = NeuralBrdf(layers)
    wi, wo = everywhere(5000)
    values = free.eval(wi, wo)
    highest = np.quantile(values, [0.5, 0.7, 0.9], axis=0).diagonal()
    network = NeuralBrdf(clamped(layers, highest))
    assert network.sizes == (6, 21, 21, 3, 3)
    np.testing.assert_allclose(network.eval(wi, wo), np.minimum(values, highest), atol=1e-5)


def test_errors_are_relative_to_what_was_measured():
    measured = np.array([[1.0, 0.5, -1.0], [2.0, 0.0, 1e-4]])
    predicted = np.array([[1.1, 0.5, -2.0], [1.0, 1e-3, 2e-4]])
    median, mean = relative_errors(predicted, measured)
    errors = [0.1, 0.0, 0.0, 0.5, 1.0, 0.1]
    assert median == pytest.approx(np.median(errors))
    assert mean == pytest.approx(np.mean(errors))


@pytest.mark.parametrize(
    "name", tiered(list_data("cornell", "*.brdf") or ["garnet_red.brdf"], ["garnet_red.brdf"])
)
def test_a_network_of_a_real_scan_is_bounded_and_better_than_the_nearest_sample(name):
    brdf = nacre.load(require_data("cornell", name))
    network = fit(brdf, Recipe(epochs=40))
    wi, wo = everywhere(100_000)
    values = network.eval(wi, wo)
    assert np.isfinite(values).all()
    assert (values <= brdf.samples.rgb.max(axis=0) * (1 + 1e-5)).all()
    far = ((wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True))[:, 2] < 0.9
    grazing = far & (np.minimum(wi[:, 2], wo[:, 2]) < 0.05)
    assert values[grazing].max() < brdf.samples.rgb.max() / 20
    quality = network.metadata["quality"]
    assert quality["held_out_samples"] == 288
    for kind in ("median", "mean"):
        assert quality[f"held_out_{kind}_error"] < quality[f"nearest_sample_{kind}_error"]
