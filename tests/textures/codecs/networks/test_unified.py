"""The unified network against the paper's words, evaluated texel by texel."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")
import torch
from torch.utils._python_dispatch import TorchDispatchMode

from nacre.textures.codecs.networks import UnifiedNetwork, UnifiedSettings, Whitening
from nacre.textures.codecs.networks.network import direction_inputs
from tests.oracles.unified_2020 import literal_codes, literal_values, literal_weights
from tests.textures.codecs.networks.made import COARSE, OTHER, texture

WHITENING = Whitening(-1.5, 1.2)


def count(network: UnifiedNetwork, *names: str) -> int:
    return sum(p.numel() for name, p in network.parameters.items() if name.startswith(names))


def test_the_network_of_the_paper_has_its_numbers_of_weights():
    network = UnifiedNetwork(UnifiedSettings(), WHITENING)
    angular = (4 * 128 + 128) + 3 * (128 * 128 + 128)
    assert angular == 50_176  # "50,000 parameters" in the paper
    assert count(network, "angular") == angular + 128 * 2400 + 2400
    assert count(network, "pooled") == 2400 + 1
    assert count(network, "encoder") == (2400 * 128 + 128) + (128 * 32 + 32)
    decoder = (36 * 106 + 106) + 3 * (106 * 106 + 106) + (106 * 3 + 3)
    assert count(network, "decoder") == decoder == 38_269
    assert count(network, "") == 711_902


@pytest.mark.parametrize("latent", [8, 16, 64, 128])
def test_another_size_of_the_code_changes_two_layers(latent):
    network = UnifiedNetwork(UnifiedSettings(latent=latent), WHITENING)
    assert count(network, "") == 711_902 + (latent - 32) * (128 + 1 + 106)
    assert network.code_dim == latent


@pytest.mark.parametrize(
    ("pooling", "products"),
    [("mean", 5000), ("max", 5000), ("max", 100)],  # one texel at a time, four entries of one
)
def test_values_and_gradients_are_those_of_the_paper(pooling, products, monkeypatch):
    monkeypatch.setattr("nacre.textures.codecs.networks.unified._PRODUCTS", products)
    settings = UnifiedSettings(
        latent=5, angular=(16, 12), features=7, hidden=(9,), pooling=pooling, decoder_hidden=(11, 8)
    )
    network = UnifiedNetwork(settings, WHITENING, seed=3)
    random = np.random.default_rng(4)
    for name, parameter in network.parameters.items():
        deviation = 3.0 if name == "pooled.bias" else 0.3  # so that both sides of it are met
        noise = torch.from_numpy(random.normal(0.0, deviation, parameter.shape))
        network.parameters[name] = (parameter.double() + noise).requires_grad_()
    texels = torch.from_numpy(random.normal(size=(4, 225, 3)))
    seen = torch.from_numpy(direction_inputs(*COARSE)).double()
    where = torch.from_numpy(direction_inputs(*OTHER)).double()
    weights = torch.from_numpy(random.normal(size=(4, 100, 3)))

    codes = network.encode(texels.mT, network.prepare_encoder(seen))
    decoded = network.decode(codes, network.prepare_decoder(where))
    gradients = torch.autograd.grad((decoded * weights).sum(), list(network.parameters.values()))

    weights_there = literal_weights(seen, network.parameters)
    expected_codes = torch.stack(
        [literal_codes(x, weights_there, network.parameters, pooling) for x in texels]
    )
    expected = torch.stack([literal_values(c, where, network.parameters) for c in expected_codes])
    theirs = torch.autograd.grad((expected * weights).sum(), list(network.parameters.values()))
    np.testing.assert_allclose(codes.detach(), expected_codes.detach(), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(decoded.detach(), expected.detach(), rtol=1e-11, atol=1e-12)
    for mine, other in zip(gradients, theirs, strict=True):
        assert float(other.abs().max()) > 0
        np.testing.assert_allclose(mine, other, rtol=1e-9, atol=1e-10)


class Largest(TorchDispatchMode):
    """Watches how many numbers a product has."""

    size = 0

    def __torch_dispatch__(self, function, types, args=(), kwargs=None):
        result = function(*args, **kwargs or {})
        if function is torch.ops.aten.mul.Tensor:
            self.size = max(self.size, result.numel())
        return result


def test_max_pooling_holds_no_more_products_than_it_says(monkeypatch):
    settings = UnifiedSettings(latent=6, features=20, pooling="max")
    network = UnifiedNetwork(settings, WHITENING, seed=1)
    texels = torch.from_numpy(texture(0).texels(slice(0, 3))).mT
    weights = network.prepare_encoder(torch.from_numpy(direction_inputs(*COARSE)))
    whole = network.encode(texels, weights)
    for limit in (1000, 4000):  # a part of a run of entries of a texel; a run of two texels
        monkeypatch.setattr("nacre.textures.codecs.networks.unified._PRODUCTS", limit)
        with Largest() as watched:
            codes = network.encode(texels, weights)
        assert 0.5 * limit < watched.size <= limit
        np.testing.assert_array_equal(codes.detach(), whole.detach())


def test_the_codec_gives_reflectance(monkeypatch):
    monkeypatch.setattr("nacre.textures.codecs.networks.network._CHUNK", 5)
    monkeypatch.setattr("nacre.textures.codecs.networks.network._ROWS", 64)
    network = UnifiedNetwork(UnifiedSettings(latent=6, features=20), WHITENING, seed=1)
    texels = texture(0).texels(slice(0, 12))
    texels[0, 0] = -1.0  # noise of a measurement
    texels.flags.writeable = False  # as arrays mapped from files are
    codes = network.encoder(*COARSE)(texels)
    seen, where = (torch.from_numpy(direction_inputs(*d)) for d in (COARSE, OTHER))
    logs = np.log(np.maximum(texels, 0.0) + 0.01)
    weights = literal_weights(seen, network.parameters)
    expected = [
        literal_codes(torch.from_numpy((x + 1.5) / 1.2), weights, network.parameters) for x in logs
    ]
    np.testing.assert_allclose(codes, np.stack(expected), atol=2e-6)
    decoded = network.decoder(*OTHER)(codes)
    whitened = [literal_values(torch.from_numpy(c), where, network.parameters) for c in codes]
    expected = np.maximum(np.exp(np.stack(whitened) * 1.2 - 1.5) - 0.01, 0.0)
    assert decoded.shape == (12, 100, 3)
    assert decoded.dtype == np.float32
    np.testing.assert_allclose(decoded, expected, rtol=1e-5, atol=1e-6)


def test_texels_and_codes_of_other_shapes_are_refused():
    network = UnifiedNetwork(UnifiedSettings(latent=6, features=20), WHITENING)
    with pytest.raises(ValueError, match=r"expected \(b, 225, 3\)"):
        network.encoder(*COARSE)(np.zeros((2, 100, 3), np.float32))
    with pytest.raises(ValueError, match=r"expected \(b, 6\)"):
        network.decoder(*COARSE)(np.zeros((2, 7), np.float32))


@pytest.mark.parametrize("pooling", ["mean", "max"])
def test_neither_order_nor_repetition_of_entries_matters(pooling):
    settings = UnifiedSettings(latent=6, features=20, pooling=pooling)
    network = UnifiedNetwork(settings, WHITENING, seed=1)
    texels, (wi, wo) = texture(0).texels(slice(0, 3)), COARSE
    codes = network.encoder(wi, wo)(texels)
    order = np.random.default_rng(0).permutation(len(wi)).repeat(2)
    other = network.encoder(wi[order], wo[order])(texels[:, order])
    np.testing.assert_allclose(codes, other, atol=1e-6)


def test_the_bilinear_decoder_is_a_product_of_coefficients_and_features():
    settings = UnifiedSettings(latent=4, decoder="bilinear", decoder_hidden=(12, 9))
    network = UnifiedNetwork(settings, WHITENING, seed=2)
    codes = torch.from_numpy(np.random.default_rng(0).normal(size=(5, 4)).astype(np.float32))
    where = torch.from_numpy(direction_inputs(*OTHER))
    values = network.decode(codes, network.prepare_decoder(where))

    def run(inputs, name):
        for index in (0, 1):
            weight, bias = (network.parameters[f"{name}.{index}.{p}"] for p in ("weight", "bias"))
            inputs = inputs @ weight + bias
            inputs = inputs.clamp(min=0.0) if index == 0 else inputs
        return inputs

    coefficients = run(codes, "coefficients").reshape(5, 3, 9)
    expected = torch.einsum("bck,nk->bnc", coefficients, run(where, "features")) / 3.0
    np.testing.assert_allclose(values, expected, atol=1e-6)


@pytest.mark.parametrize(
    "wrong",
    [
        {"latent": 0},
        {"pooling": "sum"},
        {"decoder": "cubic"},
        {"hidden": ()},
        {"angular": (1 << 20,)},
        {"decoder_hidden": (106,) * 17},
    ],
)
def test_settings_that_no_network_has_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        UnifiedSettings(**wrong)
