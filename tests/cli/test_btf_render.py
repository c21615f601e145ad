"""`nacre render` of textures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre import textures
from nacre.mitsuba.denoise import can_denoise
from tests.cli.support import run
from tests.mitsuba.textures.made import latent, picture
from tests.textures.codecs.basis.made import codec
from tests.variants import require_mitsuba

LIT = ("--light", "point", "--angle", 30)


@pytest.fixture
def cloth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An encoded texture `cloth.safetensors` and a measured one `gray.npz`."""
    require_mitsuba()
    monkeypatch.chdir(tmp_path)
    codes = np.random.default_rng(1).normal(size=(2, 4, 2))
    textures.save_latent_map(latent(codes, codec(1)), "cloth.safetensors")
    nacre.save(picture(np.full((2, 4, 3), 0.5)), "grey.npz")
    return tmp_path


def test_an_encoded_texture_beside_the_measured_one(
    capsys: pytest.CaptureFixture[str], cloth: Path
) -> None:
    import mitsuba as mi

    options = ("--size", 24, "--spp", 2, "--shape", "sphere", "--decode", "network")
    small = ("render", "cloth.safetensors", *options, "-o", "out.exr")
    assert run(*small, "--reference", "grey.npz", *LIT) == 0
    shown = capsys.readouterr().out
    assert "out.exr: 48 x 24 pixels, 2 samples per pixel, MSE x 1e4 " in shown
    image = np.array(mi.Bitmap("out.exr"))
    halves = image[:, :24], image[:, 24:]
    assert np.abs(halves[0] - halves[1])[8:16, 8:16].mean() > 1e-3
    assert run("render", "grey.npz", *options[:-2], "-o", "alone.exr") == 0
    alone = np.array(mi.Bitmap("alone.exr"))
    assert alone[12, 12].min() > 0.05
    assert run("render", "grey.npz", *options[:-2], *LIT, "--no-denoise", "-o", "lit.exr") == 0
    np.testing.assert_allclose(image[:, :24], np.array(mi.Bitmap("lit.exr")), atol=1e-4)


@pytest.mark.slow
@pytest.mark.skipif(not can_denoise(), reason="needs pyoidn (extra 'render')")
def test_a_picture_is_denoised_unless_told_otherwise(
    capsys: pytest.CaptureFixture[str], cloth: Path
) -> None:
    import mitsuba as mi

    options = ("--size", 48, "--shape", "plane")
    assert run("render", "grey.npz", *options, "-o", "clean.exr") == 0
    assert "48 x 48 pixels, 24 samples per pixel" in capsys.readouterr().out
    assert run("render", "grey.npz", *options, "--no-denoise", "-o", "truth.exr") == 0
    assert "64 samples per pixel" in capsys.readouterr().out
    assert run("render", "grey.npz", *options, "--no-denoise", "--spp", 24, "-o", "noisy.exr") == 0
    clean, noisy = (np.array(mi.Bitmap(f"{name}.exr"))[18:30, 18:30] for name in ("clean", "noisy"))
    assert clean.std(axis=(0, 1)).mean() < 0.5 * noisy.std(axis=(0, 1)).mean()
    np.testing.assert_allclose(clean.mean((0, 1)), noisy.mean((0, 1)), rtol=0.03)


def test_errors_are_shown_beside_renderings(
    capsys: pytest.CaptureFixture[str], cloth: Path
) -> None:
    from PIL import Image

    options = ("--size", 24, "--spp", 1, "--reference", "grey.npz", *LIT)
    assert run("render", "cloth.safetensors", *options, "-o", "out.png") == 0
    with Image.open("out.png") as picture:
        width, height = picture.size
    assert width > height
    assert f"out.png: {width} x {height} pixels" in capsys.readouterr().out


def test_an_animation_of_a_moving_light(capsys: pytest.CaptureFixture[str], cloth: Path) -> None:
    from PIL import Image

    options = ("--size", 24, "--spp", 1, "--frames", 3, "--light-path", "over", *LIT)
    assert run("render", "grey.npz", *options) == 0
    assert "grey.gif: 3 frames of 24 x 24 pixels, 1 samples" in capsys.readouterr().out
    assert run("render", "grey.npz", *options, "--reference", "grey.npz", "-o", "a.png") == 0
    shown = capsys.readouterr().out
    assert re.search(r"a.png: 3 frames of \d+ x \d+ pixels, 1 samples per pixel, MSE x", shown)
    figures = [float(line.split()[-1]) for line in shown.splitlines()[-4:]]
    # Threads add samples to the pixels around them in any order, so last bits differ.
    assert figures[:2] == pytest.approx([0.0, 0.0], abs=1e-5)
    assert figures[2] == pytest.approx(figures[3], rel=1e-3)
    assert figures[3] > 1e-3
    for name in ("grey.gif", "a.png"):
        with Image.open(name) as animation:
            assert animation.n_frames == 3


def test_mistakes_are_told_before_anything_is_rendered(
    capsys: pytest.CaptureFixture[str], cloth: Path
) -> None:
    for arguments, words in (
        (("missing.safetensors",), "missing.safetensors"),
        (("cloth.safetensors", "--repeat", 0), "--repeat"),
        (("cloth.safetensors", "-o", "x.tif"), "a picture ends in one of"),
        (("cloth.safetensors", "-o", "x.gif"), "a picture ends in one of"),
        (("cloth.safetensors", "--frames", 4), "directional or point light"),
        (("cloth.safetensors", "--frames", 4, "--denoise", *LIT), "not for animations"),
        (("cloth.safetensors", "--frames", 1, *LIT), "--frames"),
        (("cloth.safetensors", "--light-path", "over", *LIT), "--frames"),
        (("cloth.safetensors", "--frames", 4, *LIT, "-o", "x.mp4"), "one of .gif, .png, .webp"),
        (("cloth.safetensors", "--frames", 9999, *LIT), "make fewer or smaller ones"),
        (("cloth.safetensors", "--height-field", "no.png"), "no.png: no such file"),
    ):
        assert run("render", *arguments) != 0
        assert words in capsys.readouterr().err
    assert not list(cloth.glob("*.png"))
