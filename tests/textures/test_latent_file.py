"""Maps of codes: exact round trips, codecs embedded and referred to, and bad input."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.formats import is_btf, load_btf
from nacre.io.files import digest
from nacre.measured.textures import UTIA
from nacre.textures import LatentMap, NeuralBtf, load_latent_map, save_latent_map
from nacre.textures.codecs import save_codec
from nacre.textures.latent_file import FORMAT
from nacre.textures.latent_map import CodecFile
from tests.textures.codec_files import header_and_tensors, rewrite
from tests.textures.codecs.basis.made import codec

PAIRS = UTIA.directions[[0, 4, 20, 50]], UTIA.directions[[3, 0, 70, 9]]
FACTS = {"source": {"file": "felt.npz"}, "errors": {"MSE x 1e4": 2.5}}


def latent(dtype: str = "f4", **changes) -> LatentMap:
    codes = np.random.default_rng(4).normal(size=(3, 5, 2)).astype(dtype)
    return LatentMap(codes, codec(), *UTIA.pairs(), "felt", None, FACTS, **changes)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "felt.safetensors"
    save_latent_map(latent(), path)
    return path


@pytest.mark.parametrize("dtype", ["f2", "f4"])
@pytest.mark.parametrize("scattered", [False, True])
def test_a_map_comes_back_as_it_was(tmp_path, dtype, scattered):
    path, again = tmp_path / "a.safetensors", tmp_path / "b.safetensors"
    before = latent(dtype)
    if scattered:
        before = dataclasses.replace(before, wi=PAIRS[0], wo=PAIRS[1])
    save_latent_map(before, path)
    after = load_latent_map(path)
    assert (after.name, after.reference, after.metadata) == ("felt", None, FACTS)
    assert after.codes.dtype == dtype
    for name in ("codes", "wi", "wo"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    everything = slice(None)
    np.testing.assert_array_equal(
        NeuralBtf(after).texels(everything), NeuralBtf(before).texels(everything)
    )
    save_latent_map(after, again)
    assert again.read_bytes() == path.read_bytes()


def test_an_encoded_texture_is_a_texture(path):
    assert is_btf(path)
    btf = load_btf(path)
    assert isinstance(btf, NeuralBtf)
    assert (btf.width, btf.height, btf.pair_count) == (5, 3, 6561)
    facts = btf.describe()
    assert facts["latent size"] == 2
    assert facts["model"] == "embedded"
    assert facts["MSE x 1e4"] == 2.5
    made = latent()
    expected = made.codec.decoder(*UTIA.pairs())(made.codes.reshape(-1, 2))
    np.testing.assert_allclose(btf.texels(slice(None)), expected, rtol=1e-4, atol=1e-5)
    pictures = btf.images(np.array([7, 3000]))
    assert pictures.shape == (2, 3, 5, 3)
    np.testing.assert_allclose(
        pictures.reshape(2, 15, 3), expected[:, [7, 3000]].swapaxes(0, 1), rtol=1e-4, atol=1e-5
    )
    other = btf.at_directions(*PAIRS)
    expected = made.codec.decoder(*PAIRS)(made.codes.reshape(-1, 2))
    np.testing.assert_allclose(other.texels(np.array([14, 2])), expected[[14, 2]], atol=1e-5)


def test_a_model_beside_it_is_referred_to(tmp_path):
    model, path = tmp_path / "model.safetensors", tmp_path / "felt.safetensors"
    save_codec(codec(), model)
    save_latent_map(
        dataclasses.replace(latent(), reference=CodecFile(model.name, digest(model))), path
    )
    btf = load_btf(path)
    assert btf.describe()["model"] == "in model.safetensors"
    np.testing.assert_array_equal(btf.texels(slice(None)), NeuralBtf(latent()).texels(slice(None)))
    save_codec(codec(seed=1), model)
    with pytest.raises(FormatError, match=r"is another model .* than felt\.safetensors was"):
        load_btf(path)
    model.unlink()
    with pytest.raises(FormatError, match=r"refers to the model model\.safetensors .*copy it"):
        load_btf(path)


@pytest.mark.parametrize("name", ["", "../x", "/etc/passwd", "a/b", "\0", 3, ".", None])
def test_only_files_beside_it_are_referred_to(path, name):
    header, tensors = header_and_tensors(path)
    rewrite(path, {**header, "codec": {"file": name, "sha256": "0" * 64}}, tensors)
    with pytest.raises(FormatError, match=r"not the name of a file|not in its folder|a directory"):
        load_btf(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 7}, "version 7"),
        ({"name": 3}, "name is not a text"),
        ({"metadata": 3}, "metadata is not an object"),
        ({"metadata": {"errors": 3}}, "errors in the metadata are not an object"),
        ({"codec": 3}, "codec not an object"),
        ({"codec": {}}, "'model' is missing"),
        ({"codec": {"model": "other"}}, "unknown model 'other'"),
        ({"codec": {"file": "x", "sha256": "0"}}, "not a SHA-256"),
    ],
)
def test_a_damaged_header_is_an_error_that_names_the_field(path, change, message):
    header, tensors = header_and_tensors(path)
    rewrite(path, {**header, **change}, tensors)
    with pytest.raises(FormatError, match=message) as caught:
        load_btf(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"codes": np.zeros((3, 5, 3), "f4")}, r"expected \(height, width, 2\)"),
        ({"codes": np.zeros((0, 5, 2), "f4")}, "codes are"),
        ({"codes": np.zeros((3, 5, 2), "f8")}, "expected float16 or float32"),
        ({"codes": np.full((3, 5, 2), np.nan, "f4")}, "codes holds numbers"),
        ({"codes": np.full((3, 5, 2), np.inf, "f2")}, "codes holds numbers"),
        ({"lights": np.zeros((2, 3), "f4")}, "lights: 1 of 2, .* is not of unit length"),
        ({"lights": np.zeros((0, 3), "f4")}, "lights are 0"),
        ({"views": np.array([[0, 0, -1]], "f4")}, "views: 1 of 1, .* not above the horizon"),
        ({"views": np.zeros((2, 2), "f4")}, "views are float32"),
        ({"pairs": np.zeros((2, 2), "i8")}, "pairs are int64"),
        ({"pairs": np.array([[0, 81]], "i4")}, "that are not there"),
        ({"pairs": np.array([[-1, 0]], "i4")}, "that are not there"),
        ({"pairs": np.zeros((0, 2), "i4")}, "pairs are 0"),
        ({"lights": np.tile(np.array([[0, 0, 1]], "f4"), (5000, 1))}, "more than 262,144 pairs"),
    ],
)
def test_a_damaged_tensor_is_an_error_that_names_it(path, change, message):
    header, tensors = header_and_tensors(path)
    rewrite(path, header, tensors | change)
    with pytest.raises(FormatError, match=message) as caught:
        load_btf(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_what_is_missing_is_named(path):
    header, tensors = header_and_tensors(path)
    for key in header:
        rewrite(path, {k: v for k, v in header.items() if k != key}, tensors)
        with pytest.raises(FormatError, match=f"'{key}' is missing"):
            load_btf(path)
    for name in ("codes", "lights", "views", "codec.encode.linear"):
        rewrite(path, header, {k: v for k, v in tensors.items() if k != name})
        with pytest.raises(FormatError, match="is missing"):
            load_btf(path)


def test_codes_that_decode_to_no_numbers_are_an_error():
    made = latent()
    made.codec.functions.last.biases[:] = 3e38
    with pytest.raises(FormatError, match="felt: some codes decode to values that are not finite"):
        NeuralBtf(made).texels(slice(None))
    with pytest.raises(FormatError, match="not finite"):
        NeuralBtf(made).images(slice(0, 2))


def test_codes_must_be_numbers_to_be_written(tmp_path):
    made = latent()
    made.codes[0, 0, 0] = np.nan
    with pytest.raises(FormatError, match="codes holds numbers"):
        save_latent_map(made, tmp_path / "x.safetensors")
    assert not list(tmp_path.iterdir())
    with pytest.raises(ValueError, match="codes are"):
        dataclasses.replace(made, codes=made.codes[:, :, :1])


def test_a_texture_of_several_texels_is_no_material(path):
    with pytest.raises(FormatError, match=r"felt\.safetensors: .*nacre btf average"):
        FORMAT.load_material(path)


@pytest.mark.parametrize(("dtype", "code"), [("f2", 65472.0), ("f4", 999_936.0)])
def test_codes_may_be_as_large_as_their_precision_allows(tmp_path, dtype, code):
    path = tmp_path / "a.safetensors"
    codes = np.full((1, 1, 2), code, dtype)
    save_latent_map(LatentMap(codes, codec(), *UTIA.pairs()), path)
    np.testing.assert_array_equal(load_latent_map(path).codes, codes)
    for wrong in (np.inf, -np.inf, np.nan):
        codes[0, 0, 1] = wrong
        with pytest.raises(FormatError, match="codes holds numbers that are not finite or too"):
            save_latent_map(LatentMap(codes, codec(), *UTIA.pairs()), path)
