"""The network of 2019 against PyTorch's own layers."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")
import torch

from nacre.errors import NacreError
from nacre.measured.textures import BONN
from nacre.textures.codecs.networks import CustomNetwork, CustomSettings, Whitening
from nacre.textures.codecs.networks.network import direction_inputs
from tests.oracles.unified_2020 import literal_values
from tests.textures.codecs.networks.made import COARSE, OTHER, texture

WHITENING = Whitening(-1.0, 0.9)


def test_the_encoder_is_convolutions_pools_and_layers():
    network = CustomNetwork(*COARSE, CustomSettings(), WHITENING, seed=2)
    parts, inputs = [], 3
    for outputs in (16, 16, 32, 32):
        parts.append(torch.nn.Conv1d(inputs, outputs, 9, padding=4))
        parts += [torch.nn.ReLU(), torch.nn.MaxPool1d(4, ceil_mode=True)]
        inputs = outputs
    parts += [torch.nn.Flatten(), torch.nn.Linear(32, 128), torch.nn.ReLU()]
    theirs = torch.nn.Sequential(*parts, torch.nn.Linear(128, 8))
    with torch.no_grad():
        layers = [part for part in theirs if hasattr(part, "weight")]
        names = [*(f"convolution.{i}" for i in range(4)), "encoder.0", "encoder.1"]
        for layer, name in zip(layers, names, strict=True):
            weight = network.parameters[f"{name}.weight"]
            layer.weight.copy_(weight.mT if weight.ndim == 2 else weight)
            layer.bias.copy_(network.parameters[f"{name}.bias"])
        texels = texture(0).texels(slice(0, 3))
        logs = (np.log(texels + np.float32(0.01)) + 1.0) / 0.9
        expected = theirs(torch.from_numpy(logs).mT.float())
    codes = network.encoder(*COARSE)(texels)
    assert codes.shape == (3, 8)
    np.testing.assert_allclose(codes, expected, atol=1e-5)


def test_numbers_of_weights_at_the_directions_of_bonn():
    network = CustomNetwork(*BONN.pairs(), CustomSettings(), WHITENING)
    total = sum(p.numel() for p in network.parameters.values())
    convolutions = (27 * 16 + 16) + (144 * 16 + 16) + (144 * 32 + 32) + (288 * 32 + 32)
    length = 90  # 22,801 entries, four times a quarter, rounded up
    layers = (32 * length * 128 + 128) + (128 * 8 + 8)
    decoder = (12 * 106 + 106) + 3 * (106 * 106 + 106) + (106 * 3 + 3)
    assert total == convolutions + layers + decoder


def test_it_decodes_at_any_directions_and_encodes_at_its_own_only():
    network = CustomNetwork(*COARSE, CustomSettings(), WHITENING, seed=2)
    codes = np.random.default_rng(0).normal(size=(2, 8)).astype(np.float32)
    decoded = network.decoder(*OTHER)(codes)
    where = torch.from_numpy(direction_inputs(*OTHER))
    whitened = [literal_values(torch.from_numpy(c), where, network.parameters) for c in codes]
    expected = np.maximum(np.exp(0.9 * np.stack(whitened) - 1.0) - 0.01, 0.0)
    np.testing.assert_allclose(decoded, expected, rtol=1e-5, atol=1e-6)
    wi, wo = COARSE
    with pytest.raises(NacreError, match=r"its own 225 pairs of directions only.* got 100"):
        network.encoder(*OTHER)
    with pytest.raises(NacreError, match="got others"):
        network.encoder(wi[::-1], wo[::-1])


@pytest.mark.parametrize("wrong", [{"kernel": 4}, {"pool": 1}, {"channels": ()}, {"latent": -1}])
def test_settings_that_no_network_has_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        CustomSettings(**wrong)
