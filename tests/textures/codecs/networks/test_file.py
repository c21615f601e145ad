"""Files of networks: exact round trips, and bad input."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")

from nacre.errors import FormatError
from nacre.textures.codecs.codec_file import load_codec, save_codec
from nacre.textures.codecs.networks import (
    CustomNetwork,
    CustomSettings,
    UnifiedNetwork,
    UnifiedSettings,
    Whitening,
)
from tests.textures.codec_files import (
    assert_codec_refused,
    assert_damage_is_refused,
    assert_missing_fields_are_named,
    header_and_tensors,
    rewrite,
    rewrite_field,
)
from tests.textures.codecs.networks.made import COARSE, texture

SMALL = UnifiedSettings(latent=4, angular=(8, 8), features=5, hidden=(6,), decoder_hidden=(7, 7))
WHITENING = Whitening(-1.25, 0.75)
FACTS = {"materials": ["felt", "Holz"], "loss": 0.5}


def unified() -> UnifiedNetwork:
    return UnifiedNetwork(SMALL, WHITENING, seed=3).replaced(metadata=FACTS)


def custom() -> CustomNetwork:
    settings = CustomSettings(latent=3, channels=(4, 5), hidden=(6,), decoder_hidden=(7,))
    made = CustomNetwork(*COARSE, settings, WHITENING, seed=3)
    return made.replaced(metadata=FACTS)


@pytest.fixture(params=[unified, custom])
def network(request):
    return request.param()


def test_a_network_comes_back_as_it_was(network, tmp_path):
    path, again = tmp_path / "a.safetensors", tmp_path / "b.safetensors"
    save_codec(network, path)
    after = load_codec(path)
    assert type(after) is type(network)
    assert (after.settings, after.whitening) == (network.settings, network.whitening)
    assert (after.metadata, after.code_dim) == (FACTS, network.code_dim)
    for name, array in network.arrays().items():
        np.testing.assert_array_equal(after.arrays()[name], array)
    texels = texture(0).texels(slice(0, 4))
    codes = network.encoder(*COARSE)(texels)
    np.testing.assert_array_equal(after.encoder(*COARSE)(texels), codes)
    np.testing.assert_array_equal(after.decoder(*COARSE)(codes), network.decoder(*COARSE)(codes))
    save_codec(after, again)
    assert again.read_bytes() == path.read_bytes()


def test_half_precision_takes_half_the_bytes_and_decodes_alike(tmp_path):
    network = UnifiedNetwork(UnifiedSettings(), WHITENING, seed=1)
    whole, half = tmp_path / "whole.safetensors", tmp_path / "half.safetensors"
    save_codec(network, whole)
    save_codec(network, half, "half")
    assert whole.stat().st_size == pytest.approx(2 * half.stat().st_size, rel=0.01)
    assert half.stat().st_size < 3e6
    rounded, texels = load_codec(half), texture(0).texels(slice(0, 4))
    codes = network.encoder(*COARSE)(texels)
    np.testing.assert_allclose(rounded.encoder(*COARSE)(texels), codes, atol=1e-3)
    decoded = rounded.decoder(*COARSE)(codes)
    np.testing.assert_allclose(decoded, network.decoder(*COARSE)(codes), rtol=1e-2)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("version",), 2, "version 2"),
        (("model",), "future", "unknown model 'future'"),
        (("metadata",), [], "metadata"),
        (("whitening", "mean"), "x", "could not convert"),
        (("whitening", "deviation"), 0.0, "deviation of the whitening must be positive"),
        (("whitening", "offset"), 1e30, "offset of the whitening must be finite"),
        (("settings", "latent"), 5, "tensor 'decoder.0.weight'"),
        (("settings", "latent"), 1 << 40, "latent must be widths"),
        (("settings", "latent"), True, "setting latent is True"),
        (("settings", "angular"), [8, 8.5], "setting angular"),
        (("settings", "hidden"), [], "hidden must be widths"),
        (("settings", "pooling"), "sum", "pooling must be one of"),
        (("settings", "other"), 1, "not those that this nacre knows"),
        (("settings",), 3, "a field of its header has the wrong type"),
    ],
)
def test_a_damaged_header_is_an_error_that_names_the_field(tmp_path, place, value, message):
    path = tmp_path / "x.safetensors"
    save_codec(unified(), path)
    rewrite_field(path, place, value)
    assert_codec_refused(path, message)


def test_missing_fields_and_tensors_are_named(tmp_path):
    path = tmp_path / "x.safetensors"
    save_codec(unified(), path)
    assert_missing_fields_are_named(path)
    header, tensors = header_and_tensors(path)
    for name in tensors:
        rewrite(path, header, {k: v for k, v in tensors.items() if k != name})
        with pytest.raises(FormatError, match=f"'{name}' is missing"):
            load_codec(path)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e9])
def test_numbers_that_are_not_finite_or_too_large_are_refused(tmp_path, wrong):
    path = tmp_path / "x.safetensors"
    save_codec(unified(), path)
    header, tensors = header_and_tensors(path)
    tensors["encoder.0.weight"] = tensors["encoder.0.weight"].copy()
    tensors["encoder.0.weight"][0, 0] = wrong
    rewrite(path, header, tensors)
    with pytest.raises(FormatError, match=r"encoder\.0\.weight holds numbers"):
        load_codec(path)


def test_other_types_and_directions_are_refused(tmp_path):
    path = tmp_path / "x.safetensors"
    save_codec(custom(), path)
    header, tensors = header_and_tensors(path)
    rewrite(path, header, {k: v.astype(np.float64) for k, v in tensors.items()})
    with pytest.raises(FormatError, match="not float32 or float16"):
        load_codec(path)
    rewrite(path, header, {**tensors, "wi": 2.0 * tensors["wi"]})
    with pytest.raises(FormatError, match="wi are no unit directions"):
        load_codec(path)
    rewrite(path, header, {**tensors, "wo": tensors["wo"][:-1]})
    with pytest.raises(FormatError, match="directions have shapes"):
        load_codec(path)


def test_weights_too_large_for_half_precision_are_not_written(tmp_path):
    network, path = unified(), tmp_path / "x.safetensors"
    network.parameters["encoder.0.bias"][0] = 1e5
    with pytest.raises(FormatError, match=r"encoder\.0\.bias"):
        save_codec(network, path, "half")
    assert not path.exists()


def test_damaged_files_are_format_errors(network, tmp_path):
    path = tmp_path / "x.safetensors"
    save_codec(network, path)
    assert_damage_is_refused(path)
