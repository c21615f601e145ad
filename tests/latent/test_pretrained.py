"""The bases that come with nacre."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.brdf import CosineSampler
from nacre.cli import main
from nacre.latent import file, find_basis, pretrained_basis, pretrained_hypernetwork
from nacre.metrics import compare
from nacre.sampling import GgxMixture
from tests.data import list_data, require_data

FILE = Path(file.__file__).with_name("published.safetensors")


def test_the_file_is_small_and_says_what_it_was_trained_on():
    assert FILE.stat().st_size < 1_000_000
    materials = pretrained_basis().metadata["materials"]
    assert len(materials) == len(pretrained_basis().examples) == 120
    assert "alum-bronze" in materials
    assert not set(materials) & {name.removesuffix(".bsdf") for name in list_data("rgl", "*.bsdf")}


def test_bases_are_found_by_name_or_file(tmp_path):
    assert find_basis("neural") is pretrained_basis() is pretrained_hypernetwork().basis
    assert find_basis("hypernetwork") is pretrained_hypernetwork()
    assert find_basis(str(FILE)).code_dim == 32
    with pytest.raises(nacre.FormatError, match="neurol"):
        find_basis("neurol")


@pytest.mark.parametrize("name", ["paper_white_rgb", "satin_rosaline_rgb", "ilm_l3_37_matte_rgb"])
def test_measured_materials_that_nobody_trained_on_are_close(name):
    truth = nacre.load(require_data("rgl", f"{name}.bsdf"))
    for basis in (pretrained_basis(), pretrained_hypernetwork()):
        decoded = basis.decode(basis.encode(truth))
        for light in compare(truth, decoded, size=32, directions=64).lights:
            assert light.errors.mae < 0.02


def test_decoded_materials_sample_themselves():
    basis = pretrained_basis()
    assert isinstance(basis.decode(basis.examples[0]).sampler, GgxMixture | CosineSampler)


@pytest.mark.slow
def test_codes_need_no_basis_of_the_users_own(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    nacre.save(pretrained_basis().decode(np.zeros(32), "mean"), tmp_path / "mean.binary")
    main(["latent", "encode", "mean.binary", "-o", "mean.json"])
    assert "32 values (128 bytes)" in capsys.readouterr().out
    main(["latent", "decode", "mean.json", "-o", "again.binary"])
    main(["latent", "encode", "mean.binary", "-o", "h.json", "--basis", "hypernetwork"])
    main(["latent", "decode", "h.json", "-o", "h.safetensors", "--basis", "hypernetwork"])
    assert isinstance(nacre.load("h.safetensors"), nacre.NeuralBrdf)
    with pytest.raises(SystemExit):
        main(["latent", "decode", "h.json", "-o", "x.binary"])
    assert "is not a neural code" in capsys.readouterr().err
