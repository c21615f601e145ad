"""Files of components: exact round trips, and bad input."""

from __future__ import annotations

import json
from random import Random

import numpy as np
import pytest
import safetensors.numpy

from nacre.btf import load_codec, save_codec
from nacre.btf.codec_file import KEY
from nacre.btf.principal import PcaRecipe, find_components
from nacre.files import FormatError
from tests.btf.principal.test_components import RING, TEXTURES
from tests.specimens import mutated


@pytest.fixture(scope="module")
def codec():
    return find_components(TEXTURES, PcaRecipe(5))


@pytest.fixture
def path(codec, tmp_path):
    save_codec(codec, tmp_path / "a.safetensors")
    return tmp_path / "a.safetensors"


def test_components_come_back_as_they_were(codec, path, tmp_path):
    after = load_codec(path)
    assert (after.values, after.noise, after.metadata) == (5, codec.noise, codec.metadata)
    texels = TEXTURES[0]().texels(slice(0, 4))
    np.testing.assert_array_equal(after.encoder(*RING)(texels), codec.encoder(*RING)(texels))
    again = tmp_path / "b.safetensors"
    save_codec(after, again)
    assert again.read_bytes() == path.read_bytes()


def rewrite(path, change) -> None:
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    header = json.loads(json.loads(data[8 : 8 + size])["__metadata__"][KEY])
    tensors = safetensors.numpy.load(data)
    change(header, tensors)
    safetensors.numpy.save_file(tensors, path, {KEY: json.dumps(header)})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h, t: h.update(version=2), "version 2"),
        (lambda h, t: h.update(metadata=[]), "metadata"),
        (lambda h, t: h.update(noise=0.0), "noise is 0.0"),
        (lambda h, t: h.update(noise="x"), "noise is 'x'"),
        (lambda h, t: h.pop("noise"), "'noise' is missing"),
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
    rewrite(path, change)
    with pytest.raises(FormatError, match=message) as caught:
        load_codec(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_damaged_files_are_format_errors(path):
    whole, random = path.read_bytes(), Random(5)
    errors = []
    for data in (b"", whole[:100], *(mutated(whole, random) for _ in range(60))):
        path.write_bytes(data)
        try:
            load_codec(path)
        except FormatError as error:
            errors.append(str(error))
    assert len(errors) > 20
    assert not any("\n" in error for error in errors)
    path.write_bytes(whole[:-1])
    with pytest.raises(FormatError, match="not a whole safetensors file"):
        load_codec(path)
