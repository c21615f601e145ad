"""Commands on textures given files of another kind, and names that are taken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import TableBtf
from nacre.measured.textures import BONN
from nacre.neural import Layer, NeuralBrdf
from nacre.textures.codecs import save_codec
from tests.cli.support import run, run_json
from tests.textures.codecs.basis.made import codec

MODEL = "--codec", "model.safetensors"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A texture, the same encoded, a model, and a material; all of few directions."""
    monkeypatch.chdir(tmp_path)
    wi, wo = (w[:1] for w in BONN.pairs())
    nacre.save(TableBtf(np.full((2, 2, 1, 3), 0.5, np.float32), wi, wo), "texture.npz")
    save_codec(codec(), "model.safetensors")
    assert run("fit", "texture.npz", "-o", "code.safetensors", *MODEL) == 0
    nacre.save(NeuralBrdf([Layer(np.ones((6, 3), "f4"), np.ones(3, "f4"))]), "paint.safetensors")
    (tmp_path / "taken.npz").mkdir()
    (tmp_path / "textures").mkdir()
    (tmp_path / "textures" / "tl000_pl000_tv000_pv000.png").touch()
    (tmp_path / "factored").mkdir()
    assert run("convert", "texture.npz", "-o", "factored/x.btf") == 0
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("btf decode texture.npz -o x.npz", "texture.npz: is a texture, expected an encoded"),
        ("btf decode model.safetensors -o x.npz", "is a texture codec, expected an encoded"),
        (
            "btf decode paint.safetensors -o x.npz",
            "is one material (nacre neural material), expected",
        ),
        (
            "btf decode code.safetensors --directions berlin -o x.npz",
            "is neither a dome (bonn, utia)",
        ),
        (
            "btf decode code.safetensors --directions model.safetensors -o x.npz",
            "is a texture codec",
        ),
        (
            "fit model.safetensors -o x.safetensors",
            "is a texture codec; nacre fit encodes textures with it",
        ),
        ("fit paint.safetensors -o x.safetensors --resume", "--resume is for textures (BTFs)"),
        ("fit texture.npz -o x.safetensors --preset draft", "--preset is for networks"),
        ("fit texture.npz -o x.safetensors --model ggx", "--model is for reflectances (BRDFs)"),
        ("fit texture.npz paint.safetensors", "one texture at a time"),
        ("compare texture.npz paint.safetensors", "paint.safetensors: is a reflectance, but"),
        ("render texture.npz --height 9", "--height is for reflectances (BRDFs) and scenes"),
        ("render texture.npz --shape ball", "is a texture; expected one of cylinder, sphere"),
        ("convert texture.npz -o x.npz --material a", "--material is for files that hold several"),
        ("info texture.npz --no-physics", "--physics is for reflectances"),
        (
            "fit texture.npz -o x.safetensors --codec code.safetensors",
            "code.safetensors: is an encoded texture, expected a texture codec",
        ),
        ("compare texture.npz model.safetensors", "is a texture codec"),
        ("convert model.safetensors -o x.npz", "is a texture codec"),
        (
            "btf picture paint.safetensors -o x.png",
            "is one material (nacre neural material), expected",
        ),
        ("btf train texture.npz model.safetensors -o x.safetensors", "is a texture codec"),
        (
            "btf train factored -o x.safetensors",
            "where files in it are materials or",
        ),
        ("btf capture fabric01 --directions texture.npz -o x.npz", "expected bonn, utia or a list"),
        ("btf capture texture.npz -o x.npz", "is a texture, expected the name of a recipe"),
        ("convert texture.npz -o taken.npz", "taken.npz: is a directory"),
        ("convert texture.npz -o textures", "textures: is a directory"),
        ("btf capture --all -o texture.npz", "texture.npz: is a file, expected a folder"),
        ("fit textures -o library", "library: has no ending; write library.safetensors"),
        ("fit factored -o library", "no measured materials found, only textures (BTFs); fit these"),
    ],
)
def test_what_a_file_is_and_who_takes_it(here, capsys, arguments, words):
    before = sorted(here.iterdir())
    assert run(*arguments.split()) == 2
    shown = capsys.readouterr().err.strip()
    assert words in shown
    assert "\n" not in shown
    assert sorted(here.iterdir()) == before


def test_one_is_no_plural(here, capsys):
    assert run("convert", "texture.npz", "-o", "x.npz") == 0
    assert "2 x 2 texels, 1 pair of directions, " in capsys.readouterr().out


def test_textures_that_do_not_differ_have_an_infinite_psnr_which_json_has_not(here, capsys):
    assert run("compare", "texture.npz", "texture.npz") == 0
    (line,) = (x for x in capsys.readouterr().out.splitlines() if "PSNR" in x)
    assert line.split()[1] == "inf"
    found = run_json(capsys, "compare", "texture.npz", "texture.npz")
    assert found["psnr_db"] is None
