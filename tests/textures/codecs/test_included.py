"""The codecs that are included, on a surface that none of them was trained on."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.textures.codecs import PRETRAINED, load_codec
from nacre.textures.codecs.codec_file import codec_path
from nacre.workflows.encoding import encode_texture
from tests.cli.support import run, run_json


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    """An unseen leather, small and noisy."""
    path = tmp_path_factory.mktemp("captures") / "leather12.npz"
    assert run("btf", "capture", "leather12", "-o", path, "--texels", 6, "--paths", 64, "-q") == 0
    return path


@pytest.mark.slow
@pytest.mark.parametrize("name", PRETRAINED)
def test_included_codecs_encode_an_unseen_capture(capture, tmp_path, capsys, name):
    if name == "unified":
        pytest.importorskip("torch", reason="needs the extra 'btf'")
    output = tmp_path / "coded.safetensors"
    assert run("fit", capture, "--codec", name, "-o", output, "--no-embed", "-q") == 0
    assert output.stat().st_size < 40_000
    texture = nacre.load(output)
    assert texture.latent.codec.kind == name
    capsys.readouterr()
    found = run_json(capsys, "compare", capture, output, "-o", tmp_path / "compared.png")
    truth = nacre.load(capture).texels(slice(None))
    mean = truth.mean(axis=(0, 1))  # what a codec that knows nothing but the color would say
    assert 1e-4 * found["mse_x_1e4"] < 0.25 * np.square(truth - mean).mean()


@pytest.mark.slow
def test_codecs_are_found_by_name_or_file(capture, tmp_path):
    assert codec_path(None) == PRETRAINED["basis"]
    assert codec_path("unified") == PRETRAINED["unified"]
    assert codec_path(str(tmp_path)) == tmp_path
    assert load_codec("basis").kind == "basis"
    with pytest.raises(FormatError, match="neither"):
        load_codec("neither")
    encoded = encode_texture(capture, tmp_path / "by name.safetensors", model="basis")
    assert encoded.latent.codec.kind == "basis"


def test_a_truncated_capture_is_told_before_options_that_do_not_suit(capture, tmp_path, capsys):
    part = tmp_path / "part.npz"
    part.write_bytes(capture.read_bytes()[:5000])
    assert run("fit", part, "--codec", "unified", "-o", tmp_path / "coded.safetensors") != 0
    assert "not a whole .npz" in capsys.readouterr().err
