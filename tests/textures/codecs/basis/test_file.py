"""Files of the default codec: exact round trips, and bad input."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.measured.textures import UTIA
from nacre.textures.codecs import load_codec, save_codec
from nacre.textures.codecs.basis.codec import BasisCodec
from tests.textures.codec_files import (
    assert_codec_refused,
    assert_damage_is_refused,
    assert_missing_fields_are_named,
    header_and_tensors,
    rewrite,
    rewrite_field,
)
from tests.textures.codecs.basis.made import codec

FACTS = {"materials": ["felt", "Holz"], "loss": 0.5}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "x.safetensors"
    save_codec(codec(metadata=FACTS), path)
    return path


def test_a_codec_comes_back_as_it_was(path, tmp_path):
    before, after = codec(), load_codec(path)
    assert isinstance(after, BasisCodec)
    assert after.metadata == FACTS
    assert after.prior.noise == before.prior.noise
    wi, wo = UTIA.pairs()
    texels = np.random.default_rng(0).random((5, len(wi), 3), np.float32)
    codes = before.encoder(wi, wo)(texels)
    np.testing.assert_array_equal(after.encoder(wi, wo)(texels), codes)
    np.testing.assert_array_equal(after.decoder(wi, wo)(codes), before.decoder(wi, wo)(codes))
    again = tmp_path / "again.safetensors"
    save_codec(after, again)
    assert again.read_bytes() == path.read_bytes()


def test_half_precision_rounds_all_but_the_prior(path, tmp_path):
    half, again = tmp_path / "half.safetensors", tmp_path / "again.safetensors"
    save_codec(codec(), half, "half")
    kinds = {name: array.dtype for name, array in header_and_tensors(half)[1].items()}
    assert set(kinds.values()) == {np.dtype(np.float16), np.dtype(np.float32)}
    for name, kind in kinds.items():
        assert (kind == np.float32) == name.startswith("prior.")
    large = codec()
    large.encode.layers[0].weights[0, 0] = 1e5
    save_codec(large, again, "half")
    kinds = {name: array.dtype for name, array in header_and_tensors(again)[1].items()}
    assert kinds["encode.layers.0.weights"] == np.float32
    rounded, exact = load_codec(half), load_codec(path)
    wi, wo = UTIA.pairs()
    codes = np.array([[0.5, -0.25]], np.float32)
    np.testing.assert_allclose(
        rounded.decoder(wi, wo)(codes), exact.decoder(wi, wo)(codes), atol=2e-2
    )
    save_codec(rounded, again, None)  # what was rounded once is not rounded by half precision
    assert again.read_bytes() == half.read_bytes()
    save_codec(exact, again, None)
    assert len(again.read_bytes()) > len(half.read_bytes())


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("version",), 1, "version 1"),
        (("model",), "future", "unknown model 'future'"),
        (("metadata",), [], "metadata"),
        (("numbers",), 3, "numbers are not an object"),
        (("numbers", "prior.noise"), "x", "prior.noise is 'x', expected a float"),
        (("numbers", "prior.noise"), float("nan"), "not JSON compliant"),
        (("numbers", "functions.greys"), 3.0, "functions.greys is 3.0, expected a int"),
        (("numbers", "functions.greys"), 0, "functions: 0 of 5 functions are of luma"),
        (("numbers", "functions.greys"), True, "functions.greys is True"),
        (("numbers", "functions.greys"), 4, "networks of shapes"),
    ],
)
def test_a_damaged_header_is_an_error_that_names_the_field(path, place, value, message):
    rewrite_field(path, place, value)
    assert_codec_refused(path, re.escape(message))


def test_what_is_missing_is_named(path):
    assert_missing_fields_are_named(path)
    header, tensors = header_and_tensors(path)
    for name in tensors:
        rewrite(path, header, {k: v for k, v in tensors.items() if k != name})
        with pytest.raises(FormatError):
            load_codec(path)
    rewrite(path, header, {k: v for k, v in tensors.items() if k != "decode.linear"})
    with pytest.raises(FormatError, match=r"'decode\.linear' is missing"):
        load_codec(path)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e10])
def test_every_tensor_is_checked(path, wrong):
    header, tensors = header_and_tensors(path)
    for name, array in tensors.items():
        changed = array.copy()
        changed.flat[0] = wrong
        rewrite(path, header, {**tensors, name: changed})
        with pytest.raises(FormatError, match=f"{name} holds numbers"):
            load_codec(path)
        rewrite(path, header, {**tensors, name: np.zeros((3, 3, 3), np.float32)})
        with pytest.raises(FormatError):
            load_codec(path)


def test_sizes_are_bounded(path):
    header, tensors = header_and_tensors(path)
    rewrite(path, header, {**tensors, "decode.linear": np.zeros((1 << 14, 2), np.float32)})
    with pytest.raises(FormatError, match="wider than 8,192"):
        load_codec(path)


def test_a_codec_that_encodes_nothing_is_refused(path):
    header, tensors = header_and_tensors(path)
    header["numbers"] |= {"prior.noise": 0.0, "prior.relative_noise": 0.0}
    for name in ("covariance", "deviations"):
        tensors[f"prior.{name}"] = np.zeros_like(tensors[f"prior.{name}"])
    rewrite(path, header, tensors)
    with pytest.raises(FormatError, match=r"not finite|Singular"):
        load_codec(path)


def test_damaged_files_are_format_errors(path):
    assert_damage_is_refused(path)
