"""`--bytes-per-texel` and `--quality` of `nacre fit`, and `nacre btf recode`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import TableBtf
from nacre.measured.textures import UTIA
from nacre.metrics.texture_errors import ErrorSums
from nacre.textures import load_latent_map, save_latent_map
from nacre.textures.codecs import save_codec
from nacre.textures.rates.tiled import Tiled
from tests.cli.support import run, run_json
from tests.textures.rates.made import latent


@pytest.fixture
def felt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> TableBtf:
    """`felt.npz`, and `felt.safetensors`, which the codec in `model.safetensors` made."""
    monkeypatch.chdir(tmp_path)
    encoded = latent(40, 50)
    save_codec(encoded.codec, "model.safetensors")
    save_latent_map(encoded, "felt.safetensors")
    wi, wo = (w[::40] for w in UTIA.pairs())
    values = encoded.codec.decoder(wi, wo)(encoded.codes.reshape(-1, 6)).reshape(40, 50, -1, 3)
    made = TableBtf(values, wi, wo, "felt")
    nacre.save(made, "felt.npz")
    return made


FIT = "fit", "felt.npz", "--codec", "model.safetensors", "-o"


def test_a_texture_is_fitted_in_so_many_bytes(felt, capsys):
    figures = run_json(capsys, *FIT, "small.safetensors", "--bytes-per-texel", "3")
    assert 2.8 < figures["bytes_per_texel"] <= 3.0
    found = nacre.load("small.safetensors")
    assert found.latent.rated.nbytes == figures["bytes_of_codes"]
    mse = 1e4 * np.square(found.texels(slice(None)) - felt.texels(slice(None))).mean()
    assert figures["mse_x_1e4"] == pytest.approx(mse, rel=1e-3)
    assert run("info", "small.safetensors", "-v") == 0
    assert "bytes per texel" in capsys.readouterr().out
    again = nacre.fit("felt.npz", codec="model.safetensors", bytes_per_texel=3.0)
    np.testing.assert_array_equal(again.latent.codes, found.latent.codes)


def test_the_model_may_stay_in_its_file(felt, capsys):
    for size in ("0.5", "40"):
        rate = "--bytes-per-texel", size
        assert run(*FIT, "small.safetensors", "--no-embed", "--force", *rate) == 0
        found = load_latent_map(Path("small.safetensors"))
        assert found.reference is not None
        assert found.reference.name == "model.safetensors"


def test_an_encoded_texture_is_written_in_fewer_bytes(felt, capsys):
    recode = "btf", "recode", "felt.safetensors", "-o"
    figures = run_json(capsys, *recode, "small.safetensors", "--bytes-per-texel", "2")
    assert 1.8 < figures["bytes_per_texel"] <= 2.0
    assert figures["size_bytes"] == Path("small.safetensors").stat().st_size
    metadata = load_latent_map(Path("small.safetensors")).metadata
    assert metadata["recoded from"]["file"] == "felt.safetensors"
    lost = figures["mse_x_1e4_against_the_codes_before"]
    assert metadata["errors"]["MSE x 1e4"] == pytest.approx(2.5 + lost)
    coarse = run_json(capsys, *recode, "coarse.safetensors", "--quality", "25")
    fine = run_json(capsys, *recode, "fine.safetensors", "--quality", "40")
    assert coarse["bytes_per_texel"] < 0.5 * fine["bytes_per_texel"]


@pytest.mark.parametrize(
    ("command", "work"),
    [
        ("fit", "compared"),
        ("recode", "written"),
        pytest.param("fit", "written", marks=pytest.mark.slow),
        pytest.param("recode", "compared", marks=pytest.mark.slow),
    ],
)
def test_stopped_work_goes_on_with_resume_only(felt, capsys, monkeypatch, command, work):
    begin = {"fit": FIT, "recode": ("btf", "recode", "felt.safetensors", "-o")}[command]
    arguments = (*begin, "small.safetensors", "--bytes-per-texel", "40")
    assert run(*arguments) == 0
    whole = Path("small.safetensors").read_bytes()
    Path("small.safetensors").unlink()
    count, of, name = {
        "written": (2, Tiled, "_written"),
        "compared": (1 if command == "fit" else 0, ErrorSums, "add"),
    }[work]
    with monkeypatch.context() as patch:
        done, usual = [], getattr(of, name)

        def stopped(*arguments):
            done.append(1)
            if len(done) > count:
                raise KeyboardInterrupt
            return usual(*arguments)

        patch.setattr(of, name, stopped)
        assert run(*arguments) == 130
    states = sorted(path.name for path in Path().glob("small.safetensors.state*"))
    assert states
    assert not Path("small.safetensors").exists()
    capsys.readouterr()
    assert run(*arguments) == 2
    assert "add --resume" in capsys.readouterr().err
    assert run(*arguments[:-1], "39", "--resume") == 2
    assert "belongs to another run" in capsys.readouterr().err
    assert run(*arguments, "--resume") == 0
    found = Path("small.safetensors").read_bytes()
    assert found == whole
    assert not list(Path().glob("small.safetensors.state*"))


def test_the_start_of_a_file_is_a_texture(felt, capsys):
    rate = "--bytes-per-texel", "2"
    assert run("btf", "recode", "felt.safetensors", "-o", "small.safetensors", *rate) == 0
    whole = load_latent_map(Path("small.safetensors"))
    data = Path("small.safetensors").read_bytes()
    left_out = int(whole.rated.lengths[3:].sum())
    Path("cut.safetensors").write_bytes(data[:-left_out])
    assert run("info", "cut.safetensors") == 2
    assert "cut short" in capsys.readouterr().err
    recode = "btf", "recode", "cut.safetensors", "-o", "coarse.safetensors"
    assert run(*recode, "--levels", "4") == 2
    assert "cut short" in capsys.readouterr().err
    assert run(*recode, "--levels", "3") == 0
    coarse = load_latent_map(Path("coarse.safetensors"))
    assert "errors" not in coarse.metadata
    wanted = whole.rated.without(len(whole.rated.lengths) - 3).codes
    np.testing.assert_array_equal(coarse.codes, wanted)


def test_other_commands_take_it(felt, capsys):
    rate = "--bytes-per-texel", "40"
    assert run(*FIT, "small.safetensors", *rate) == 0
    assert run("compare", "felt.npz", "small.safetensors", "-o", "sheet.png") == 0
    assert run("btf", "mipmap", "small.safetensors") == 0
    assert run("btf", "average", "small.safetensors", "-o", "mean.safetensors") == 0
    assert run("btf", "synthesize", "small.safetensors", "-o", "large.safetensors") == 0
    assert run("convert", "small.safetensors", "-o", "copy.safetensors") == 0
    copied, before = (load_latent_map(Path(f"{n}.safetensors")) for n in ("copy", "small"))
    np.testing.assert_array_equal(copied.codes, before.codes)
    assert copied.rated is not None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*FIT, "x.safetensors", "--bytes-per-texel", "0.1"), "0.5"),
        ((*FIT, "x.safetensors", "--bytes-per-texel", "2", "--quality", "30"), "either"),
        ((*FIT, "x.safetensors", "--quality", "30", "--precision", "half"), "--precision"),
        (("btf", "recode", "felt.safetensors", "-o", "x.safetensors"), "one of"),
        (("btf", "recode", "felt.npz", "-o", "x.safetensors", "--quality", "30"), "felt.npz"),
        (("btf", "recode", "felt.safetensors", "-o", "x.npz", "--quality", "30"), "x.npz"),
        (("btf", "recode", "felt.safetensors", "-o", "x.safetensors", "--levels", "2"), "levels"),
    ],
)
def test_mistakes_are_errors_of_one_line(felt, capsys, arguments, message):
    assert run(*arguments) == 2
    shown = capsys.readouterr().err
    assert message in shown
    assert not Path("x.safetensors").exists()
