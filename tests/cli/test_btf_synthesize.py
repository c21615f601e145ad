"""`nacre btf synthesize`, `blend` and `mipmap`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nacre.io.files import digest
from nacre.textures import load_latent_map, save_latent_map
from nacre.textures.codecs import save_codec
from nacre.textures.latent_map import CodecFile
from tests.cli.support import run
from tests.textures.codecs.basis.made import codec
from tests.textures.synthesis.test_quilting import latent

pytest.importorskip("PIL.Image", reason="needs the extra 'render'")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With `felt.safetensors` and `silk.safetensors`."""
    monkeypatch.chdir(tmp_path)
    save_latent_map(latent(12, 16), "felt.safetensors")
    save_latent_map(replace(latent(16, 12, seed=1), name="silk"), "silk.safetensors")
    return tmp_path


SYNTHESISE = "btf", "synthesize", "felt.safetensors", "-o", "big.safetensors"


def test_a_larger_texture_is_an_encoded_texture(capsys):
    assert run(*SYNTHESISE, "--texels", "30x20", "--tile", "--patch", 6, "--seed", 2, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["width"], facts["height"], facts["patch"], facts["overlap"]) == (30, 20, 6, 2)
    assert facts["contrast_of_seams"] > 0.0
    made = load_latent_map("big.safetensors")
    assert made.codes.shape == (20, 30, 2)
    assert made.metadata["source"]["sha256"] == digest("felt.safetensors")
    assert made.metadata["synthesis"]["seed"] == 2
    before = {bytes(code) for code in latent(12, 16).codes.reshape(-1, 2)}
    assert {bytes(code) for code in made.codes.reshape(-1, 2)} <= before
    first = Path("big.safetensors").read_bytes()
    assert run(*SYNTHESISE, "--texels", "30x20", "--tile", "--patch", 6, "--seed", 2) == 0
    assert "share of the input used" in capsys.readouterr().out
    assert Path("big.safetensors").read_bytes() == first
    assert run("info", "big.safetensors") == 0
    assert run(*SYNTHESISE) == 0
    assert load_latent_map("big.safetensors").codes.shape == (60, 80, 2)


def test_a_model_is_referred_to_only_beside_it(folder):
    save_codec(codec(), "model.safetensors")
    reference = CodecFile("model.safetensors", digest("model.safetensors"))
    save_latent_map(replace(latent(12, 16), reference=reference), "felt.safetensors")
    (folder / "other").mkdir()
    for output, expected in (("big.safetensors", reference), ("other/big.safetensors", None)):
        assert run(*SYNTHESISE[:3], "-o", output, "--texels", "16x16") == 0
        assert load_latent_map(output).reference == expected


def test_a_mixture(capsys):
    from PIL import Image

    mask = np.zeros((4, 4), np.uint8)
    mask[:, 2:] = 255
    Image.fromarray(mask).save("mask.png")
    blend = "btf", "blend", "felt.safetensors", "silk.safetensors", "-o", "mixed.safetensors"
    assert run(*blend, "--mask", "mask.png", "--texels", "16x16") == 0
    assert "mixed.safetensors: 16 x 16 texels, 50.0 % silk.safetensors" in capsys.readouterr().out
    made = load_latent_map("mixed.safetensors")
    assert made.name == "felt to silk"
    assert [s["file"] for s in made.metadata["blend"]["sources"]] == [
        "felt.safetensors",
        "silk.safetensors",
    ]
    assert made.metadata["blend"]["mask"]["sha256"] == digest("mask.png")
    np.testing.assert_array_equal(made.codes[:12, :4], latent(12, 16).codes[:, :4])
    assert run(*blend, "--mask", "noise", "--no-keep-contrast") == 0
    assert load_latent_map("mixed.safetensors").codes.shape == (16, 16, 2)


def test_levels(capsys):
    from PIL import Image

    command = "btf", "mipmap", "felt.safetensors"
    errors = {}
    for by in ("reflectance", "codes"):
        assert run(*command, "--filter", by, "--json", "-o", "levels.png", "--wi", "10,0") == 0
        found = json.loads(capsys.readouterr().out)
        assert [level["texels"] for level in found["levels"]] == [
            "8 x 6",
            "4 x 3",
            "2 x 1",
            "1 x 1",
        ]
        errors[by] = [level["mse_x_1e4"] for level in found["levels"]]
        assert all(np.isfinite(errors[by]))
    assert errors["reflectance"] != errors["codes"]
    with Image.open("levels.png") as picture:
        assert picture.size == (4 * 128 + 3 * 4, 2 * 96)
    assert run(*command) == 0
    shown = capsys.readouterr().out
    assert "relative RMSE" in shown
    assert "filtered by reflectance in" in shown


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*SYNTHESISE, "--texels", "1x4"), "expected 2x2 or more"),
        ((*SYNTHESISE, "--texels", "8", "--scale", 2), "either --texels or --scale"),
        ((*SYNTHESISE, "--patch", 13), r"larger than the input (16 x 12)"),
        ((*SYNTHESISE, "--patch", 8, "--overlap", 5), "overlap by 1 to 4 texels, not 5"),
        ((*SYNTHESISE, "--scale", 0.01), "the output has 2 x 2 to 16,777,216 texels, not 0 x 0"),
        ((*SYNTHESISE, "--tolerance", "nan"), "expected a number (0 or more), got 'nan'"),
        ((*SYNTHESISE[:3], "-o", "big.npz"), "an encoded texture is a .safetensors file"),
        ((*SYNTHESISE[:3], "-o", "felt.safetensors"), "is the input as well"),
        (("btf", "synthesize", "text.npz", "-o", "x.safetensors"), "text.npz"),
        (("btf", "blend", "felt.safetensors", "other.safetensors"), "by different models"),
        (("btf", "blend", "felt.safetensors", "model.safetensors"), "is a texture codec"),
        (
            ("btf", "blend", "felt.safetensors", "silk.safetensors", "--mask", "text.npz"),
            "a mask is a gray PNG or JPEG image",
        ),
        (("btf", "mipmap", "felt.safetensors", "-o", "x.gif"), "a picture ends in one of"),
        (("btf", "mipmap", "model.safetensors"), "expected an encoded texture"),
    ],
)
def test_what_is_wrong_is_named_in_a_line(arguments, message, capsys):
    Path("text.npz").write_text("no texture")
    save_codec(codec(), "model.safetensors")
    save_latent_map(replace(latent(seed=1), codec=codec(seed=7)), "other.safetensors")
    if arguments[1] == "blend":
        arguments = (*arguments, "-o", "x.safetensors")
    assert run(*arguments) != 0
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not Path("x.safetensors").exists()
