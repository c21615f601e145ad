"""`nacre btf train`, from files to a network that encodes others."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")

from nacre.errors import FormatError
from nacre.textures.codecs.basis import network_training
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.recipe import BasisRecipe
from nacre.textures.codecs.codec_file import load_codec
from nacre.textures.codecs.networks import CustomNetwork, TrainingRecipe, UnifiedNetwork, training
from nacre.workflows.codec_training import train_codec
from tests.cli.support import run
from tests.textures.codecs.networks.conftest import one_thread
from tests.textures.codecs.networks.made import OTHER, texture, write

__all__ = ["one_thread"]


def test_any_registered_codec_can_be_named(files, tmp_path, capsys):
    output = tmp_path / "model.safetensors"
    assert run("btf", "train", *files, "-o", output, "--model", "magic") == 2
    assert "'magic' is no known" in capsys.readouterr().err


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    return write(tmp_path, 2)


def test_a_texture_that_changes_meanwhile_ends_the_training(files, tmp_path):
    output = tmp_path / "model.safetensors"

    def change(*_: object) -> None:
        content = files[0].read_bytes()
        files[0].unlink()
        files[0].write_bytes(content)

    with pytest.raises(FormatError, match="has changed since the training began"):
        train_codec(files, output, model="custom", steps=60, progress=change)
    assert not output.exists()


def test_a_unified_network_is_trained_and_encodes_another_texture(files, tmp_path, capsys):
    output = tmp_path / "model.safetensors"
    options = (
        "--model",
        "unified",
        "--steps",
        12,
        "--code-dim",
        5,
        "--pooling",
        "max",
        "--batch",
        6,
        "--precision",
        "half",
    )
    assert run("btf", "train", *files, "-o", output, *options, "--loss", "l2") == 0
    assert f"{output}: 12 steps, latent size 5, loss on held-out" in capsys.readouterr().out
    network = load_codec(output)
    assert isinstance(network, UnifiedNetwork)
    assert network.settings.pooling == "max"
    assert network.metadata["training"]["loss"] == "l2"
    made = texture(7, directions=OTHER)
    codes = network.encoder(made.wi, made.wo)(made.texels(slice(None)))
    assert codes.shape == (36, 5)
    assert np.isfinite(codes).all()
    rows = output.with_name("model.safetensors.journal.csv").read_text().splitlines()
    assert rows[0] == "step,seconds,learning_rate,loss,validation"
    assert [row.split(",")[0] for row in rows[1:]] == ["10", "12"]
    assert not output.with_name("model.safetensors.state").exists()


def test_a_custom_network_has_its_own_loss_and_size(files, tmp_path):
    output = tmp_path / "model.safetensors"
    assert run("btf", "train", files[0], "-o", output, "--model", "custom", "--steps", 2) == 0
    network = load_codec(output)
    assert isinstance(network, CustomNetwork)
    assert network.code_dim == 8
    assert network.metadata["training"]["loss"] == "l2"
    assert network.metadata["training"]["permute"] is False


def test_what_was_interrupted_goes_on_with_resume_only(files, tmp_path, capsys, monkeypatch):
    output, state = tmp_path / "model.safetensors", tmp_path / "model.safetensors.state"
    arguments = "btf", "train", *files, "-o", output, "--model", "unified"
    arguments += "--steps", 12, "--code-dim", 4, "--batch", 6

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(training._Training, "_note", interrupted)
        assert run(*arguments) == 130
    assert state.exists()
    assert not output.exists()
    assert run(*arguments) == 2
    assert "--resume" in capsys.readouterr().err
    times = files[1].stat()
    os.utime(files[1], ns=(times.st_atime_ns, times.st_mtime_ns + 1))
    for others in ([], ["--steps", 13]):  # the file is another, then the number of steps
        assert run(*arguments, *others, "--resume") == 2
        assert "belongs to another run" in capsys.readouterr().err
        os.utime(files[1], ns=(times.st_atime_ns, times.st_mtime_ns))
    assert run(*arguments, "--resume") == 0
    assert not state.exists()
    whole = load_codec(output).arrays()
    output.unlink()
    assert run(*arguments) == 0
    for name, array in load_codec(output).arrays().items():
        np.testing.assert_array_equal(array, whole[name])


def test_epochs_and_the_sizes_of_the_decoder(files, tmp_path):
    output = tmp_path / "model.safetensors"
    sizes = "--model", "unified", "--epochs", 2, "--batch", 16, "--decoder-hidden", "7,9"
    assert run("btf", "train", *files, "-o", output, *sizes) == 0
    network = load_codec(output)
    assert network.settings.decoder_hidden == (7, 9)
    assert network.metadata["epochs"] == 2.0
    assert network.metadata["steps"] % 2 == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "model.npz"], "a model is a .safetensors file"),
        (["--model", "unified", "--steps", "3", "--minutes", "1"], "give one of them"),
        (["--model", "unified", "--steps", "3", "--epochs", "1"], "give one of them"),
        (["--model", "unified", "--decoder-hidden", "0,8"], "up to 8 widths from 1 to 4096"),
        (["--epochs", "3"], "--epochs is for --model unified and custom"),
        (["--model", "custom", "--pooling", "max"], "--pooling is for --model unified"),
        (["--model", "unified", "--device", "cuda:99"], "device 'cuda:99' cannot be used"),
        (["--batch", "0"], "--batch"),
        (["--batch", "8"], "--batch is for --model unified and custom"),
        (["--recipe", "default"], "--recipe is for --model unified and custom"),
        (["--minutes", "1"], "--minutes is for --model unified and custom"),
        (["--device", "cpu"], "--device is for --model unified and custom"),
        (["--code-dim", "200"], "kind basis have up to 128 values"),
        (["--seed", "99999999999999999999"], "--seed"),
        (
            ["--model", "unified", "--learning-rate", "inf"],
            "--learning-rate: expected above 0, up to 1,000, got inf",
        ),
        (["--model", "unified", "--learning-rate", "1e300"], "--learning-rate"),
        (
            ["--model", "unified", "--minutes", "nan"],
            "expected a number (above 0, up to 1,000,000)",
        ),
    ],
)
def test_wrong_options_are_errors_of_one_line(files, tmp_path, capsys, options, message):
    output = tmp_path / "model.safetensors"
    assert run("btf", "train", *files, "-o", output, *options) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not output.exists()


def test_bad_files_are_errors_of_one_line(files, tmp_path, capsys):
    output, bad = tmp_path / "model.safetensors", tmp_path / "bad.npz"
    bad.write_bytes(b"nothing")
    assert run("btf", "train", files[0], bad, "-o", output) == 2
    error = capsys.readouterr().err
    assert "bad.npz" in error
    assert error.count("\n") == 1
    assert (
        run(
            *("btf", "train", *files, "-o", files[0].with_suffix(".safetensors")),
            *("--model", "unified", "--steps", 1),
        )
        == 0
    )
    (tmp_path / "other").mkdir()
    (other,) = write(tmp_path / "other", 1, directions=OTHER)
    custom = "--model", "custom", "--steps", 1
    assert run("btf", "train", files[1], other, "-o", output, *custom) == 2
    assert "2 sets of directions" in capsys.readouterr().err


BASIS = "--steps", 20, "--code-dim", 5, "--seed", 3


def test_the_default_model_is_trained_and_encodes_another_texture(files, tmp_path, capsys):
    output = tmp_path / "model.safetensors"
    assert run("btf", "train", *files, "-o", output, *BASIS, "--precision", "half") == 0
    assert f"{output}: 20 steps, latent size 5" in capsys.readouterr().out
    codec = load_codec(output)
    assert isinstance(codec, BasisCodec)
    assert codec.metadata["materials"] == ["0", "1"]
    assert codec.metadata["training"]["seed"] == 3
    assert codec.metadata["training"]["function_steps"] == 8
    made = texture(7, directions=OTHER)
    codes = codec.encoder(made.wi, made.wo)(made.texels(slice(None)))
    assert codes.shape == (36, 5)
    assert np.isfinite(codes).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "0.npz",
        "1.npz",
        "model.safetensors",
    ]


@pytest.mark.slow
def test_the_default_model_goes_on_to_the_same_bytes(files, tmp_path, capsys, monkeypatch):
    """However often it is stopped: on the way through a stage, and at the last step of one."""
    output = tmp_path / "model.safetensors"
    arguments = "btf", "train", *files, "-o", output, *BASIS
    descend = network_training.descend
    for where, stop in (("functions", 5), ("functions", -1), ("codes", 5), ("completion", 5)):

        def interrupted(vectors, matrices, loss, steps, stage, *rest, where=where, stop=stop):
            def stopping(step):
                if stage == where and step == stop % steps:
                    os.kill(os.getpid(), signal.SIGINT)
                return loss(step)

            descend(vectors, matrices, stopping, steps, stage, *rest)

        names = {path.name for path in tmp_path.iterdir()}
        resume = ["--resume"] if any(name.endswith(".state") for name in names) else []
        with monkeypatch.context() as patch:
            for module in ("function_training", "code_training"):
                patch.setattr(f"nacre.textures.codecs.basis.{module}.descend", interrupted)
            assert run(*arguments, *resume) == 130
        names = {path.name for path in tmp_path.iterdir()}
        assert f"model.safetensors.state.{where}-steps.state" in names
        assert not output.exists()
        capsys.readouterr()
        assert run(*arguments) == 2
        assert "add --resume to continue" in capsys.readouterr().err
        assert run(*arguments[:-1], 4, "--resume") == 2
        assert "belongs to another run" in capsys.readouterr().err
    assert run(*arguments, "--resume") == 0
    assert not list(tmp_path.glob("*.state"))
    content = output.read_bytes()
    output.unlink()
    assert run(*arguments) == 0
    assert output.read_bytes() == content


def test_a_table_that_is_no_journal_is_not_written_over(files, tmp_path, capsys):
    output = tmp_path / "model.safetensors"
    arguments = "btf", "train", *files, "-o", output, "--model", "unified", "--steps", 1
    journal = tmp_path / "model.safetensors.journal.csv"
    for path in (tmp_path / "model.csv", journal):
        path.write_text("sample,weight\n1,2\n")
    assert run(*arguments) == 2
    assert f"{journal}: is not a training's table" in capsys.readouterr().err
    journal.unlink()
    for _ in range(2):
        assert run(*arguments) == 0
        assert len(journal.read_text().splitlines()) == 2
    assert (tmp_path / "model.csv").read_text() == "sample,weight\n1,2\n"


def test_bad_textures_leave_nothing_of_the_default_model_behind(files, tmp_path, capsys):
    (tmp_path / "other").mkdir()
    (other,) = write(tmp_path / "other", 1, directions=OTHER)
    large, bad = texture(5), tmp_path / "bad.npz"
    large.values[:] = 1e6
    np.savez(bad, values=large.values, wi=large.wi, wo=large.wo, name="another name")
    before = sorted(tmp_path.iterdir())
    for given, latent, words in (
        ((files[0], other), 5, f"{other}: is not measured at the directions of {files[0]}"),
        ((files[0],), 10, "at least 40 texels to learn from; there are 36"),
        ((*files, bad), 5, f"{bad}: values: some are too large"),
    ):
        options = "-o", tmp_path / "model.safetensors", "--code-dim", latent
        assert run("btf", "train", *given, *options) == 2
        assert words in capsys.readouterr().err
        assert sorted(tmp_path.iterdir()) == before


def test_states_of_other_models_are_not_mixed(files, tmp_path, capsys):
    output = tmp_path / "model.safetensors"
    for name, model in (("state.codes.state", "unified"), ("state", "basis")):
        other = tmp_path / f"model.safetensors.{name}"
        other.touch()
        for options in ([], ["--resume"]):
            assert run("btf", "train", *files, "-o", output, "--model", model, *options) == 2
            error = capsys.readouterr().err
            assert f"{other}: something else was stopped here" in error
            assert "remove model.safetensors.state*" in error
        other.unlink()


def test_one_process_trains_the_default_model(files, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("WORLD_SIZE", "2")
    assert run("btf", "train", *files, "-o", tmp_path / "model.safetensors") == 2
    assert "leave out torchrun" in capsys.readouterr().err


def test_help_tells_the_defaults_of_every_model(capsys):
    assert run("btf", "train", "--help") == 0
    shown = " ".join(capsys.readouterr().out.split())
    basis, reference = BasisRecipe(), TrainingRecipe.named("reference")
    steps = basis.function_steps + basis.code_steps
    most = basis.luma_count + 2 * basis.chroma_count
    assert f"[default: {steps:,}; for unified and custom {TrainingRecipe().epochs} epochs" in shown
    assert f"up to {most} for basis. [1 to 1,024; default: {basis.code_dim}; 8 for custom" in shown
    default, custom = TrainingRecipe(), CustomNetwork.recipe().training
    rates = f"default: {default.learning_rate}; {reference.learning_rate} with the reference"
    assert rates in shown
    batches = f"default: {default.batch}; {custom.batch} for custom; {reference.batch} with the ref"
    assert batches in shown
