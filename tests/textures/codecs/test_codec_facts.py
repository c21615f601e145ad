"""What is told of files of codecs, against what they were made of."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.textures.codecs import PUBLISHED, load_codec, save_codec
from nacre.textures.codecs.codec_file import codec_facts, codec_fingerprint
from nacre.textures.codecs.principal import PcaCodec
from tests.textures.codec_files import header_and_tensors, rewrite_field
from tests.textures.codecs.basis.made import codec

TRAINED = {
    "materials": ["felt", "Holz"],
    "training": {"code_steps": 50, "seed": 3},
    "loss": 0.5,
    "model": "another",
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "x.safetensors"


def test_the_default_codec(path):
    save_codec(codec(metadata=TRAINED), path, "half")
    facts = codec_facts(path)
    weights = sum(array.size for array in header_and_tensors(path)[1].values())
    assert facts == {
        "model": "basis",
        "latent size": 2,
        "directions": "any",
        "luma functions": 3,
        "chroma functions": 2,
        "layers, functions": [12, 6, 6, 8, 6],
        "layers, completion": [14, 7, 7, 7],
        "layers, encoder": [7, 5, 5, 2],
        "layers, decoder": [2, 5, 5, 7],
        "weights": weights,
        "precision": ["float16", "float32"],
        "materials in training": 2,
        "materials": ["felt", "Holz"],
        "training, code steps": 50,
        "training, seed": 3,
        "loss": 0.5,
        "file": str(path),
        "bytes": path.stat().st_size,
    }


def test_principal_components(path):
    up = np.tile(np.array([[0.0, 0.0, 1.0]], np.float32), (4, 1))
    ones = np.ones((2, 4, 3), np.float32)
    save_codec(PcaCodec(up, up, ones[0], ones, ones[:, 0, 0], 0.1, {"texels": 9}), path)
    facts = codec_facts(path)
    assert (facts["model"], facts["latent size"]) == ("principal components", 2)
    assert facts["directions"] == "4 pairs"
    assert facts["weights"] == 4 * 3 + 2 * 4 * 3 + 2
    assert facts["texels"] == 9


def test_networks(path):
    pytest.importorskip("torch", reason="needs the extra 'btf'")
    from nacre.textures.codecs.networks import UnifiedNetwork, UnifiedSettings, Whitening

    sizes = {"angular": (8, 9), "features": 5, "hidden": (6,), "decoder_hidden": (7, 7)}
    network = UnifiedNetwork(UnifiedSettings(latent=4, **sizes), Whitening(-1.0, 0.5))
    save_codec(network, path)
    facts = codec_facts(path)
    assert (facts["model"], facts["latent size"], facts["directions"]) == ("unified", 4, "any")
    assert (facts["angular"], facts["decoder hidden"]) == ([8, 9], [7, 7])
    assert facts["weights"] == sum(array.size for array in network.arrays().values())


def test_damage_is_an_error_that_names_the_field(path):
    save_codec(codec(), path)
    rewrite_field(path, ("numbers", "functions.greys"), 0)
    with pytest.raises(FormatError, match="functions: 0 of 5 functions are of luma") as caught:
        codec_facts(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_the_pretrained_codec_has_the_fingerprint_that_maps_of_texels_have_of_it():
    expected = "13113e67cbe34df17f43a0e64962546a4fa80bb2ffb051721a1efe54b8d5ce94"
    assert codec_fingerprint(load_codec(PUBLISHED)) == expected
