"""`nacre btf encode`, `decode` and `compare`, from a texture to a report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import TableBtf
from nacre.measured.textures import UTIA
from nacre.textures import NeuralBtf
from nacre.textures.codecs import save_codec
from nacre.workflows import encoding
from tests.cli.support import run, run_json
from tests.specimens.images import png_bytes
from tests.textures.codecs.basis.made import codec


@pytest.fixture
def felt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> TableBtf:
    """`felt.npz`, which the codec in `model.safetensors` can express."""
    monkeypatch.chdir(tmp_path)
    save_codec(codec(), "model.safetensors")
    codes = np.random.default_rng(8).normal(size=(12, 2)).astype(np.float32)
    values = codec().decoder(*UTIA.pairs())(codes).reshape(3, 4, -1, 3)
    made = TableBtf(values, *UTIA.pairs(), "felt")
    nacre.save(made, "felt.npz")
    return made


ENCODE = "fit", "felt.npz", "-o", "felt.safetensors", "--codec", "model.safetensors"


def test_the_way_from_a_texture_to_a_report(felt, capsys):
    assert run(*ENCODE) == 0
    shown = capsys.readouterr().out
    assert ["width", "4"] in [line.split() for line in shown.splitlines()]
    assert "pairs compared a texel" in shown
    found = nacre.load("felt.safetensors")
    assert isinstance(found, NeuralBtf)
    metadata = found.latent.metadata
    assert metadata["source"]["file"] == "felt.npz"
    assert len(metadata["source"]["sha256"]) == 64
    assert metadata["errors"]["pairs compared a texel"] == 6561
    assert not Path("felt.safetensors.state").exists()

    assert run("btf", "decode", "felt.safetensors", "-o", "again.npz") == 0
    assert "again.npz: 4 x 3 texels, 6,561 pairs" in capsys.readouterr().out
    report = "compare", "felt.npz", "again.npz"
    figures = run_json(capsys, *report, "-o", "sheet.png")
    difference = nacre.load("again.npz").texels(slice(None)) - felt.texels(slice(None))
    mse = 1e4 * np.mean(difference.astype(float) ** 2)
    assert figures["mse_x_1e4"] == pytest.approx(mse, rel=1e-4)
    assert metadata["errors"]["MSE x 1e4"] == pytest.approx(mse, rel=0.05)
    assert figures["pairs_compared"] == 6561
    assert len(figures["worst_texels"]) == 5
    image = pytest.importorskip("PIL.Image", reason="needs the extra 'render'")
    with image.open("sheet.png") as picture:
        assert min(picture.size) > 800
        assert len(picture.getcolors(1 << 20)) > 50
    assert run("compare", "felt.npz", "felt.safetensors", "--pairs", 50) == 0
    shown = capsys.readouterr().out
    for words in ("felt.safetensors against felt.npz", "PSNR", "75-90 degrees", "worst texels"):
        assert words in shown


def test_what_is_in_a_model_is_shown(felt, capsys):
    assert run("info", "-v", "model.safetensors") == 0
    shown = capsys.readouterr().out
    facts = [line.split() for line in shown.splitlines()]
    assert ["model", "basis"] in facts
    assert ["latent", "size", "2"] in facts
    (found,) = run_json(capsys, "info", "model.safetensors")
    assert (found["file"], found["kind"]) == ("model.safetensors", "codec")
    assert found["size_bytes"] == Path("model.safetensors").stat().st_size
    assert run("info", "model.safetensors", "--pixels", "radiance") == 2
    assert "model.safetensors: has no images" in capsys.readouterr().err


def test_other_directions(felt, capsys):
    assert run(*ENCODE, "--precision", "half") == 0
    Path("list.csv").write_text("theta_l,phi_l,theta_v,phi_v\n0,0,30,10\n45,90,0,0\n")
    Path("each.csv").write_text("theta,phi\n0,0\n45,90\n")
    counts = {"bonn": 22801, "utia": 6561, "list.csv": 2, "each.csv": 4, "felt.npz": 6561}
    for directions, count in counts.items():
        options = "-o", "x.npz", "--directions", directions
        assert run("btf", "decode", "felt.safetensors", *options) == 0
        assert nacre.load("x.npz").pair_count == count
    assert "error" not in capsys.readouterr().out
    assert run("btf", "decode", "felt.safetensors", "-o", "x.btf", "--directions", "list.csv") == 0
    assert "mean absolute error" in capsys.readouterr().out
    for content, message in (
        ("theta_l,phi_l,theta_v\n0,0,30\n", "columns: phi_v missing"),
        ("theta_l,phi_l,theta_v,phi_v\n", "lists no directions"),
        ("theta_l,phi_l,theta_v,phi_v\n95,0,0,0\n", "is not from 0 to below 90"),
    ):
        Path("list.csv").write_text(content)
        options = "-o", "x.npz", "--directions", "list.csv"
        assert run("btf", "decode", "felt.safetensors", *options) == 2
        assert message in capsys.readouterr().err


def test_other_commands_take_an_encoded_texture(felt, capsys):
    assert run(*ENCODE, "--precision", "half") == 0
    capsys.readouterr()
    (facts,) = run_json(capsys, "info", "felt.safetensors")
    assert facts["format"] == "nacre encoded texture"
    assert facts["codes"] == "float16"
    assert run("convert", "felt.safetensors", "-o", "x.npz") == 0
    assert run("btf", "picture", "felt.safetensors", "-o", "x.png") == 0
    assert run("latent", "encode", "felt.safetensors", "-o", "x.json") == 2
    assert "not one material" in capsys.readouterr().err


def test_the_model_may_stay_in_a_file_of_its_own(felt, capsys, tmp_path):
    assert run(*ENCODE) == 0
    whole = Path("felt.safetensors").stat().st_size
    assert run(*ENCODE, "--no-embed") == 0
    assert "keep model.safetensors beside it" in capsys.readouterr().out
    assert Path("felt.safetensors").stat().st_size < whole / 1.5
    assert run("info", "felt.safetensors") == 0
    (tmp_path / "sub").mkdir()
    elsewhere = "fit", "felt.npz", "-o", "sub/felt.safetensors"
    assert run(*elsewhere, "--codec", "model.safetensors", "--no-embed") == 2
    assert "copy it there, or embed" in capsys.readouterr().err


def run_interrupted(monkeypatch, *arguments):
    """Ctrl-C after two blocks of texels."""
    read = encoding._read_ahead

    def interrupted(*arguments):
        for index, block in enumerate(read(*arguments)):
            if index == 2:
                raise KeyboardInterrupt
            yield block

    with monkeypatch.context() as patch:
        patch.setattr(encoding, "_read_ahead", interrupted)
        assert run(*arguments) == 130


def test_what_was_interrupted_goes_on_with_resume_only(felt, capsys, monkeypatch):
    assert run(*ENCODE, "--texels-per-block", 3) == 0
    whole = Path("felt.safetensors").read_bytes()
    Path("felt.safetensors").unlink()
    run_interrupted(monkeypatch, *ENCODE, "--texels-per-block", 3)
    assert Path("felt.safetensors.state").exists()
    assert not Path("felt.safetensors").exists()
    capsys.readouterr()
    assert run(*ENCODE, "--texels-per-block", 3) == 2
    assert "--resume" in capsys.readouterr().err
    assert run(*ENCODE, "--texels-per-block", 4, "--resume") == 2
    assert "belongs to another run" in capsys.readouterr().err
    assert run(*ENCODE, "--texels-per-block", 3, "--resume") == 0
    assert Path("felt.safetensors").read_bytes() == whole
    assert not Path("felt.safetensors.state").exists()


def test_a_capture_is_encoded_as_it_is_measured(felt, capsys, monkeypatch):
    """The codes are those of its file, also of an interrupted run that went on."""
    Path("two.csv").write_text("theta,phi\n0,0\n45,90\n")
    capture = "btf", "capture", "felt01", "--texels", 4, "--paths", 2, "--directions", "two.csv"
    assert run(*capture, "-o", "made.npz") == 0
    assert run("fit", "made.npz", "-o", "made.safetensors") == 0
    expected = nacre.load("made.safetensors").latent.codes
    coded = *capture, "-o", "coded.safetensors"
    monkeypatch.setattr(encoding, "BLOCK", 12 * 4 * 3)
    assert run(*capture, "-o", "whole.safetensors") == 0
    run_interrupted(monkeypatch, *coded)
    capsys.readouterr()
    assert run(*coded) == 2
    assert "add --resume" in capsys.readouterr().err
    assert run(*coded, "--seed", 1, "--resume") == 2
    assert "belongs to another run" in capsys.readouterr().err
    assert run(*coded, "--resume", "--picture", "coded.png") == 0
    found = nacre.load("coded.safetensors").latent
    assert Path("coded.safetensors").read_bytes() == Path("whole.safetensors").read_bytes()
    np.testing.assert_allclose(found.codes, expected, atol=4e-5)  # float32, in another order
    assert found.metadata["source"]["file"] == "felt01"
    assert not Path("coded.safetensors.state").exists()
    assert Path("coded.png").exists()
    for option in (("--resume",), ("--codec", "basis")):
        assert run(*capture, "-o", "values.npz", *option) == 2
        assert f"{option[0]} is for codes (.safetensors)" in capsys.readouterr().err


@pytest.mark.slow
def test_a_local_cluster_writes_the_same_file(felt, capsys):
    pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    assert run(*ENCODE, "--texels-per-block", 3) == 0
    whole = Path("felt.safetensors").read_bytes()
    Path("felt.safetensors").unlink()
    capsys.readouterr()
    assert run(*ENCODE, "--texels-per-block", 3, "--scheduler", "local", quiet=False) == 0
    assert Path("felt.safetensors").read_bytes() == whole
    assert "dashboard: http://127.0.0.1:" in capsys.readouterr().err
    assert not Path("felt.safetensors.state").exists()


@pytest.fixture
def photographs(tmp_path):
    """A list of two photographs of 4 x 5 pixels."""
    folder = tmp_path / "photographs"
    folder.mkdir()
    for name in ("a.png", "b.png"):
        (folder / name).write_bytes(png_bytes(np.full((5, 4, 3), 128, np.uint8), 4, 5))
    lines = "file,theta_l,phi_l,theta_v,phi_v\na.png,0,0,45,180\nb.png,60,0,0,0\n"
    (folder / "directions.csv").write_text(lines)
    return folder


def test_no_encoding_goes_on_with_other_pixels(photographs, felt, capsys, monkeypatch):
    options = "-o", "x.safetensors", "--codec", "model.safetensors", "--texels-per-block", 3
    first = "fit", photographs, *options
    run_interrupted(monkeypatch, *first, "--pixels", "radiance")
    capsys.readouterr()
    assert run(*first, "--pixels", "reflectance", "--resume") == 2
    assert "belongs to another run" in capsys.readouterr().err
    (photographs / "b.png").write_bytes(png_bytes(np.zeros((5, 4, 3), np.uint8), 4, 5))
    assert run(*first, "--pixels", "radiance", "--resume") == 2
    assert "belongs to another run" in capsys.readouterr().err


def test_a_list_of_photographs_is_what_its_folder_is(photographs, felt, capsys):
    listed, pixels = photographs / "directions.csv", ("--pixels", "radiance")
    assert run_json(capsys, "compare", photographs, listed, *pixels)["mse_x_1e4"] == 0.0
    assert run("convert", photographs, "-o", "radiance.npz", *pixels) == 0
    capsys.readouterr()
    assert run_json(capsys, "compare", "radiance.npz", listed, *pixels)["mse_x_1e4"] < 1e-3
    assert run("fit", listed, "-o", "x.safetensors", "--codec", "model.safetensors") == 0
    size = sum(path.stat().st_size for path in photographs.iterdir())
    assert f"bytes of the source             {size:,}" in capsys.readouterr().out


def test_measurements_are_not_overwritten(photographs, felt, capsys):
    before = (photographs / "a.png").read_bytes(), Path("felt.npz").read_bytes()
    assert run(*ENCODE) == 0
    for arguments in (
        ("btf", "picture", photographs, "-o", photographs / "a.png"),
        ("compare", photographs, photographs, "-o", photographs / "a.png"),
        ("btf", "decode", "felt.safetensors", "--directions", "felt.npz", "-o", "felt.npz"),
    ):
        assert run(*arguments) == 2
        assert "is the input as well" in capsys.readouterr().err
    assert ((photographs / "a.png").read_bytes(), Path("felt.npz").read_bytes()) == before


def test_a_folder_of_images_is_encoded(felt, tmp_path, capsys):
    folder = tmp_path / "cloth"
    folder.mkdir()
    for theta in (0, 30, 60):
        image = np.full((4, 5, 3), 128 + theta, np.uint8)
        (folder / f"tl{theta:03}_pl000_tv000_pv000.png").write_bytes(png_bytes(image, 5, 4))
    options = "-o", "cloth.safetensors", "--codec", "model.safetensors"
    assert run("fit", folder, *options) == 0
    assert "code dim" in capsys.readouterr().out
    assert nacre.load("cloth.safetensors").pair_count == 3
    assert run("compare", folder, "cloth.safetensors") == 0


def test_a_network_for_other_directions_is_an_error_of_one_line(felt, capsys):
    pytest.importorskip("torch", reason="needs the extra 'btf'")
    from nacre.textures.codecs.networks import CustomNetwork, CustomSettings, Whitening

    settings = CustomSettings(latent=3, channels=(4, 5), hidden=(6,), decoder_hidden=(7,))
    wi, wo = (w[:100] for w in UTIA.pairs())
    save_codec(CustomNetwork(wi, wo, settings, Whitening(-1.0, 1.0)), "model.safetensors")
    assert run(*ENCODE) == 2
    error = capsys.readouterr().err
    assert "its own 100 pairs of directions only" in error
    assert error.count("\n") == 1
    save_codec(CustomNetwork(*UTIA.pairs(), settings, Whitening(-1.0, 1.0)), "model.safetensors")
    assert run(*ENCODE) == 0
    assert run("btf", "decode", "felt.safetensors", "-o", "x.npz", "--directions", "bonn") == 0


def test_the_model_that_comes_along_encodes_an_unseen_capture(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert (
        run("btf", "capture", "wood12", "-o", "wood.npz", "--texels", 4, "--directions", "utia")
        == 0
    )
    assert (
        run("fit", "wood.npz", "-o", "wood.safetensors", "--precision", "half", "--no-embed") == 0
    )
    assert Path("wood.safetensors").stat().st_size < 10_000
    decoded, truth = nacre.load("wood.safetensors"), nacre.load("wood.npz")
    values = truth.texels(slice(None))
    error = np.square(decoded.texels(slice(None)) - values).mean()
    assert error < 0.12 * np.square(values - values.mean((0, 1))).mean()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("fit", "felt.npz", "-o", "x.npz", "--codec", "model.safetensors"), "a .safetensors"),
        (("fit", "felt.npz", "-o", "x.safetensors", "--codec", "no"), "no: no such file"),
        ((*ENCODE, "--scheduler", "host"), "'host' is neither local nor like tcp://host:8786"),
        ((*ENCODE, "--scheduler", "local", "--jobs", "2"), "--jobs is for reflectances (BRDFs)"),
        ((*ENCODE, "--data", "path"), "--data is for a cluster; add its --scheduler"),
        (
            ("fit", "felt.npz", "-o", "model.safetensors", "--codec", "model.safetensors"),
            "is the input as well",
        ),
        (("btf", "decode", "felt.npz", "-o", "x.npz"), "is a texture, expected an encoded"),
        (("btf", "decode", "model.safetensors", "-o", "x.npz"), "is a texture codec, expected an"),
        (("btf", "decode", "model.safetensors", "-o", "x.foo"), "no format for textures ends in"),
        (("compare", "felt.npz", "small.npz"), "4 x 3 and 2 x 2 texels"),
        (("compare", "felt.npz", "felt.npz", "-o", "x.foo"), "a picture ends in"),
        (
            ("compare", "felt.npz", "felt.npz", "--pixels", "radiance"),
            "neither texture is a folder",
        ),
    ],
)
def test_mistakes_are_errors_of_one_line(felt, capsys, arguments, message):
    nacre.save(TableBtf(felt.values[:2, :2], felt.wi, felt.wo), "small.npz")
    assert run(*arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
