"""Spectral networks: values, files, fits."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre.brdf import COLOR
from nacre.errors import FormatError, NacreError
from nacre.instruments import mean_differences
from nacre.neural import Recipe, SpectralBrdf, fit, fit_spectral
from nacre.neural.broad_bands import BroadBands
from nacre.neural.file import encode
from nacre.neural.scattered import hold_out, relative_errors
from nacre.numerics.mlp import Layer
from nacre.testing import check_brdf, parametrize
from tests.data import list_data, require_data
from tests.reflectances import Glossy
from tests.spectra import BANDS, Coated, color_of, pairs, scanned, spectral_network

QUICK = Recipe.spectral("draft", epochs=6, hidden=(16, 16))


@parametrize(check_brdf(spectral_network))
def test_contracts_of_reflectances(check):
    check()


def test_values_are_sums_of_spectra_and_their_color_is_that_of_the_network():
    network, (wi, wo) = spectral_network(), pairs()
    x = np.stack(network.input_components(tuple(wi.T), tuple(wo.T)), axis=1).astype(np.float64)
    for layer, square in zip(network.coefficient_layers, (2, 1, 1, 0), strict=True):
        x = x @ layer.weights + layer.biases
        x = np.maximum(x, 0.0) ** square if square else np.exp(x)
    expected = (x - 1.0) @ network.spectra.values
    assert network.eval_spectral(wi, wo).shape == (500, len(BANDS))
    np.testing.assert_allclose(network.eval_spectral(wi, wo), expected, rtol=1e-4, atol=1e-5)
    found = network.eval(wi, wo)
    np.testing.assert_allclose(
        found, np.maximum(color_of(network, wi, wo), 0), rtol=1e-3, atol=1e-4
    )


@pytest.mark.parametrize("bands", [[905.0], [532.0, 905.0], [1550.0, 1600.0, 1650.0, 1700.0]])
def test_lines_and_the_infrared_are_bands_like_others(bands):
    network, (wi, wo) = spectral_network(bands), pairs()
    spectra, channels = network.eval_spectral(wi, wo), network.eval(wi, wo)
    assert network.channels[0] == f"{bands[-1]:g} nm"
    np.testing.assert_allclose(channels[:, 0], spectra[:, -1], rtol=1e-4)
    np.testing.assert_allclose(channels[:, 2], spectra[:, 0], rtol=1e-4)


def test_channels_are_chosen_like_those_of_measurements():
    network, (wi, wo) = spectral_network(), pairs()
    one = network.in_bands([520.0])
    assert one.channels == ("520 nm",) * 3
    np.testing.assert_allclose(
        one.eval(wi, wo)[:, 1], network.eval_spectral(wi, wo)[:, 6], rtol=1e-4
    )
    assert one.in_bands("color") == network
    with pytest.raises(NacreError, match="no band is near 905 nm"):
        network.in_bands([905.0])


def test_between_bands_values_are_linear_and_beyond_them_constant():
    network, (wi, wo) = spectral_network(), pairs(50)
    components = tuple(np.float64(wi).T), tuple(np.float64(wo).T)
    coefficients, spectra = network.coefficients(*components), network.eval_spectral(wi, wo)
    for wavelength in (360.0, 400.0, 411.0, 555.5, 700.0, 830.0):
        found = network.at_wavelength(coefficients, np.full(50, wavelength))
        expected = [np.interp(wavelength, BANDS, row) for row in spectra]
        np.testing.assert_allclose(found, expected, rtol=1e-4)


@pytest.mark.parametrize("precision", ["single", "half"])
@pytest.mark.parametrize("bands", [BANDS, [905.0]])
def test_files_bring_everything_back(tmp_path, bands, precision):
    network = spectral_network(bands)
    kind = np.float16 if precision == "half" else np.float32
    layers = [Layer(x.weights.astype(kind), x.biases) for x in network.coefficient_layers]
    network = SpectralBrdf(
        layers,
        network.activations[:-1],
        network.spectra.values.astype(kind),
        bands,
        name="kept",
        metadata={"fit": {"seed": 3}, "quality": {"held_out_loss": 0.1}},
        precision=precision,
    ).replaced(notes=("A note.",))
    nacre.save(network, tmp_path / "a.safetensors")
    back = nacre.load(tmp_path / "a.safetensors")
    assert isinstance(back, SpectralBrdf)
    assert encode(back) == encode(network)
    wi, wo = pairs()
    np.testing.assert_array_equal(back.eval_spectral(wi, wo), network.eval_spectral(wi, wo))
    np.testing.assert_array_equal(back.eval(wi, wo), network.eval(wi, wo))
    assert (back.channels, back.notes, back.metadata) == (
        network.channels,
        network.notes,
        network.metadata,
    )
    stored = sum(array.nbytes for array in network.stored.values())
    assert back.nbytes == network.nbytes == stored


def test_a_file_in_other_channels_opens_in_them(tmp_path):
    network = spectral_network().in_bands([440.0, 560.0, 700.0])
    nacre.save(network, tmp_path / "a.safetensors")
    back = nacre.load(tmp_path / "a.safetensors")
    assert back.channels == network.channels == ("700 nm", "560 nm", "440 nm")
    np.testing.assert_array_equal(back.layers[-1].weights, network.layers[-1].weights)


def test_damaged_files_are_refused_in_one_line(tmp_path):
    data, path = encode(spectral_network()), tmp_path / "bad.safetensors"
    changes = (
        (data[:-40], "is not a whole safetensors file"),
        (data.replace(b'spectra\\"', b'sqectra\\"').replace(b'"spectra"', b'"sqectra"'), "spectra"),
        (data.replace(b"[400.0, 420.0", b"[420.0, 420.0"), "wavelengths do not increase"),
        (data.replace(b"[400.0, 420.0", b"[-40.0, 420.0"), "wavelengths do not increase"),
        (data.replace(b"squared relu", b"squared rolu"), "is none of"),
    )
    for content, message in changes:
        assert content != data
        path.write_bytes(content)
        with pytest.raises(FormatError, match=message) as caught:
            nacre.load(path)
        assert "\n" not in str(caught.value)


def test_broad_bands_rebuild_what_lies_between():
    spectra = Coated(np.linspace(400.0, 700.0, 61)).eval_spectral(*pairs(200))
    broad = BroadBands.of(np.linspace(400.0, 700.0, 61), 10)
    assert broad.weights.shape == (61, 10)
    np.testing.assert_allclose(broad.weights.sum(axis=0), 1.0)
    rebuilt = broad.means(spectra) @ broad.rebuilding(spectra)
    np.testing.assert_allclose(rebuilt, spectra, rtol=0.02, atol=1e-3)
    few = BroadBands.of(BANDS[:3], 10)
    np.testing.assert_array_equal(few.means(spectra[:, :3]), spectra[:, :3])
    np.testing.assert_allclose(few.rebuilding(spectra[:, :3]), np.eye(3), atol=1e-4)


@pytest.mark.slow
def test_a_fit_to_a_scan_knows_held_out_spectra_and_its_bound():
    scan = scanned(Coated())
    network = fit_spectral(scan, Recipe.spectral("draft", epochs=20))
    _, held = hold_out(len(scan.samples), 0.2, 0)
    wi, wo, truth = scan.samples.wi[held], scan.samples.wo[held], scan.spectra[held]
    median, mean = relative_errors(network.eval_spectral(wi, wo), truth)
    quality = network.metadata["quality"]
    assert (quality["held_out_median_error"], quality["held_out_mean_error"]) == (median, mean)
    assert median < 0.05
    part = scan.subset(held)
    differences = mean_differences(part, network, wi, wo)
    assert max(differences.values()) < 1.5
    plain = fit(scan, Recipe.preset("draft"))
    assert mean_differences(part, plain, wi, wo)["F11"] > 2.0 * differences["F11"]


def test_the_same_seed_gives_the_same_file_and_another_a_different_one():
    scan = scanned(Coated(), 200)
    few = Recipe.spectral(epochs=2, samples=4000, hidden=(8, 8))
    first, second = (encode(fit_spectral(scan, few)) for _ in range(2))
    assert first == second
    other = Recipe.spectral(epochs=2, samples=4000, hidden=(8, 8), seed=1)
    assert encode(fit_spectral(scan, other)) != first


@pytest.mark.parametrize("bands", [[905.0], [532.0, 905.0]])
def test_fits_to_lines(bands):
    network = fit_spectral(scanned(Coated(bands), 300), QUICK)
    assert network.spectra.values.shape == (len(bands), len(bands))
    np.testing.assert_allclose(network.spectra.values, np.eye(len(bands)), atol=2e-3)
    assert network.channels == Coated(bands).channels


@pytest.mark.slow
def test_fits_to_what_is_known_everywhere():
    network = fit_spectral(Coated(), Recipe.spectral("draft", samples=50_000))
    wi, wo = pairs()
    error, _ = relative_errors(network.eval_spectral(wi, wo), Coated().eval_spectral(wi, wo))
    assert error < 0.03
    assert network.channels == COLOR
    assert network.nbytes < 8_000


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"physical": True}, "not physical"),
        ({"inputs": "paper"}, "enhanced inputs"),
        ({"activation": "relu"}, "squared ReLUs"),
        ({"size": 4000}, "no size limit"),
    ],
)
def test_settings_that_do_not_apply_are_refused(settings, message):
    with pytest.raises(NacreError, match=message):
        fit_spectral(scanned(Coated(), 50), Recipe.spectral(**settings))


def test_a_material_in_rgb_is_refused():
    with pytest.raises(NacreError, match="known in RGB only"):
        fit_spectral(Glossy(0.2, 0.1, 0.3))
    with pytest.raises(NacreError, match="too few"):
        fit_spectral(scanned(Coated(), 8))


@pytest.mark.slow
@pytest.mark.parametrize("name", list_data("cornell", "*.brdf"))
def test_colors_of_the_cornell_scans_beat_those_of_rgb_networks(name):
    scan = nacre.load(require_data("cornell", name))
    network, plain = fit_spectral(scan, Recipe.spectral("draft")), fit(scan)
    _, held = hold_out(len(scan.samples), 0.2, 0)
    part = scan.subset(held)
    where = part.samples.wi, part.samples.wo
    found, peer = (mean_differences(part, each, *where) for each in (network, plain))
    assert found["A"] < peer["A"]
    assert found["F11"] < peer["F11"]
    assert network.nbytes <= 3 * plain.nbytes
    assert 10 * network.nbytes <= 4 * scan.spectra.size + 4 * 4 * len(scan.samples)
