"""`nacre btf render`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nacre import btf
from tests.btf.basis.made import codec
from tests.cli.support import run
from tests.render.btf.made import latent, picture
from tests.variants import require_mitsuba


@pytest.fixture
def cloth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An encoded texture `cloth.safetensors` and a measured one `grey.npz`."""
    require_mitsuba()
    monkeypatch.chdir(tmp_path)
    codes = np.random.default_rng(1).normal(size=(2, 4, 2))
    btf.save_latent_map(latent(codes, codec(1)), "cloth.safetensors")
    btf.save(picture(np.full((2, 4, 3), 0.5)), "grey.npz")
    return tmp_path


def test_an_encoded_texture_beside_the_measured_one(
    capsys: pytest.CaptureFixture[str], cloth: Path
) -> None:
    import mitsuba as mi

    options = ("--size", 24, "--spp", 2, "--geometry", "sphere", "--decoder", "network")
    small = ("btf", "render", "cloth.safetensors", *options, "-o", "out.exr")
    assert run(*small, "--reference", "grey.npz", "--light", "point", "--angle", 30) == 0
    shown = capsys.readouterr().out
    assert "out.exr: 48 x 24 pixels, 2 samples per pixel, MSE x 1e4 of the picture" in shown
    image = np.array(mi.Bitmap("out.exr"))
    halves = image[:, :24], image[:, 24:]
    assert np.abs(halves[0] - halves[1])[8:16, 8:16].mean() > 1e-3
    assert run("btf", "render", "grey.npz", *options, "-o", "alone.exr") == 0
    assert np.array(mi.Bitmap("alone.exr"))[12, 12].min() > 0.05


def test_mistakes_are_told_before_anything_is_rendered(
    capsys: pytest.CaptureFixture[str], cloth: Path
) -> None:
    for arguments, words in (
        (("missing.safetensors",), "missing.safetensors"),
        (("cloth.safetensors", "--repeat", 0), "--repeat"),
        (("cloth.safetensors", "-o", "x.tif"), "a picture ends in one of"),
        (("cloth.safetensors", "--height-field", "no.png"), "no.png: height field cannot be read"),
    ):
        assert run("btf", "render", *arguments) != 0
        assert words in capsys.readouterr().err
    assert not list(cloth.glob("*.png"))
