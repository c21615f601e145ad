"""Files of components: exact round trips, and bad input."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.textures.codecs import load_codec, save_codec
from nacre.textures.codecs.principal import PcaRecipe, find_components
from tests.textures.codec_files import (
    assert_codec_refused,
    assert_damage_is_refused,
    assert_missing_fields_are_named,
    header_and_tensors,
    rewrite,
)
from tests.textures.codecs.principal.test_components import RING, TEXTURES


@pytest.fixture(scope="module")
def codec():
    return find_components(TEXTURES, PcaRecipe(5))


@pytest.fixture
def path(codec, tmp_path):
    save_codec(codec, tmp_path / "a.safetensors")
    return tmp_path / "a.safetensors"


def test_components_come_back_as_they_were(codec, path, tmp_path):
    after = load_codec(path)
    assert (after.code_dim, after.noise, after.metadata) == (5, codec.noise, codec.metadata)
    texels = TEXTURES[0]().texels(slice(0, 4))
    np.testing.assert_array_equal(after.encoder(*RING)(texels), codec.encoder(*RING)(texels))
    again = tmp_path / "b.safetensors"
    save_codec(after, again)
    assert again.read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h, t: h.update(version=2), "version 2"),
        (lambda h, t: h.update(metadata=[]), "metadata"),
        (lambda h, t: h.update(noise=0.0), "noise is 0.0"),
        (lambda h, t: h.update(noise="x"), "noise is 'x'"),
        (lambda h, t: t.pop("mean"), "'mean' is missing"),
        (lambda h, t: t.update(wi=2 * t["wi"]), "wi are no unit directions"),
        (lambda h, t: t.update(wi=t["wi"][:4]), "wo have shape"),
        (lambda h, t: t.update(mean=t["mean"].astype("f8")), "mean are not float32"),
        (lambda h, t: t.update(mean=t["mean"] * np.float32(np.nan)), "mean holds numbers"),
        (lambda h, t: t.update(variances=-t["variances"]), "variances and noise must be positive"),
        (lambda h, t: t.update(variances=t["variances"][:3]), "components have shape"),
    ],
)
def test_damage_is_an_error_that_names_the_field(path, change, message):
    header, tensors = header_and_tensors(path)
    change(header, tensors)
    rewrite(path, header, tensors)
    assert_codec_refused(path, message)


def test_what_is_missing_is_named(path):
    assert_missing_fields_are_named(path)


def test_damaged_files_are_format_errors(path):
    assert_damage_is_refused(path)
