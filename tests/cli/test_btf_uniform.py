"""`nacre btf average` and `nacre btf tile`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.analytic.lambert import Lambert
from nacre.btf import TableBtf
from nacre.measured.textures import BONN
from nacre.textures.codecs import save_codec
from tests.cli.support import assert_refused, run
from tests.textures.codecs.basis.made import codec

MODEL = "--codec", "model.safetensors"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    wi, wo = (w[::700] for w in BONN.pairs())
    values = np.linspace(0.1, 0.9, 6, dtype=np.float32)[:, None, None]
    values = np.broadcast_to(values, (6, len(wi), 3)).reshape(2, 3, len(wi), 3)
    nacre.save(TableBtf(values, wi, wo), "texture.npz")
    save_codec(codec(), "model.safetensors")
    nacre.save(Lambert(diffuse=(0.5, 0.5, 0.5)), "grey.json")
    return tmp_path


def test_a_texture_becomes_a_material_and_that_a_texture(here, capsys) -> None:
    assert run("btf", "average", "texture.npz", "-o", "mean.npz") == 0
    np.testing.assert_allclose(nacre.load("mean.npz").texels(slice(None)), 0.5, rtol=1e-3)
    assert run("btf", "average", "texture.npz", "-o", "mean.safetensors", *MODEL) == 0
    assert "1 x 1" in capsys.readouterr().out
    assert nacre.load("mean.safetensors").name == "texture"
    size = "--texels", "4x2"
    assert run("btf", "tile", "mean.safetensors", "-o", "4.safetensors", *size, *MODEL) == 0
    spread = nacre.load("4.safetensors")
    assert (spread.width, spread.height, spread.pair_count) == (4, 2, 151 * 151)


def test_a_material_is_spread_over_given_directions(here) -> None:
    Path("two.csv").write_text("theta_l,phi_l,theta_v,phi_v\n0,0,30,0\n40,90,0,0\n")
    arguments = "-o", "grey.npz", "--texels", "3x2", "--directions", "two.csv"
    assert run("btf", "tile", "grey.json", *arguments) == 0
    grey = nacre.load("grey.npz")
    assert (grey.width, grey.height, grey.pair_count) == (3, 2, 2)
    np.testing.assert_allclose(grey.texels(slice(None)), 0.5, rtol=1e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("average grey.json -o x.npz", "is one material (analytic), expected a texture"),
        ("average texture.npz -o x.json", "analytic files hold one material"),
        ("average texture.npz -o x.npz --codec model.safetensors", "--codec is for an output"),
        (
            "average texture.npz -o x.safetensors --codec texture.npz",
            "texture, expected a texture codec",
        ),
        ("average texture.npz -o texture.npz", "texture.npz"),
        ("tile texture.npz -o x.npz", "is a texture (BTF), not one material; nacre btf average"),
        ("tile grey.json -o x.npz --texels 0x3", "expected 1 to 16384 texels"),
        ("tile grey.json -o x.npz --directions berlin", "berlin"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(here, capsys, arguments, words) -> None:
    assert_refused(capsys, words, "btf", *arguments.split())
