"""Standard input and output in place of files, and names of outputs."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import nacre
from nacre.analytic.lambert import Lambert
from nacre.cli import main
from tests.cli.support import assert_refused, run
from tests.reflectances import Glossy


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    nacre.save(Lambert(diffuse=(0.5, 0.5, 0.5)), "grey.json")
    nacre.save(Glossy(0.2, 0.5, 0.3), "gold.binary")
    return tmp_path


def piped(content: bytes, *arguments: object) -> tuple[int, bytes, str]:
    """Exit code, standard output and standard error of a command given standard input."""
    code = 0
    with CliRunner().isolation(content) as streams:
        try:
            main(["-q", *map(str, arguments)])
        except SystemExit as stop:
            code = int(stop.code or 0)
        sys.stdout.flush()
        return code, streams[0].getvalue(), streams[1].getvalue().decode()


def test_a_material_is_read_from_standard_input():
    code, out, err = piped(Path("grey.json").read_bytes(), "info", "-", "--json", "--no-physics")
    assert code == 0, err
    assert json.loads(out)[0]["model"] == "Lambert"
    code, _, err = piped(b"[nonsense", "info", "-")
    assert code == 2
    assert err.startswith("nacre: stdin")
    assert err.count("\n") == 1


def test_a_model_is_written_to_standard_output():
    options = ("--model", "lambert", "--samples", 1000)
    code, out, err = piped(b"", "fit", "gold.binary", *options, "-o", "-")
    assert code == 0, err
    assert json.loads(out)
    assert "lambert, diffuse" in err
    assert run("fit", "gold.binary", *options, "-o", "again.json") == 0
    assert Path("again.json").read_bytes() == out
    assert sorted(p.name for p in Path().iterdir()) == ["again.json", "gold.binary", "grey.json"]


def test_a_list_of_directions_is_written_to_standard_output():
    code, out, err = piped(b"", "btf", "plan", "--count", 2, "-o", "-")
    assert code == 0, err
    lines = [line for line in out.decode().splitlines() if not line.startswith("#")]
    assert lines[0].startswith("file,")
    assert len(lines) == 3


def test_no_binary_file_goes_to_standard_output_and_no_folder_is_made(capsys):
    for arguments in (
        ("convert", "gold.binary", "-o", "-"),
        ("fit", "gold.binary", "-o", "-"),
        ("render", "gold.binary", "-o", "-"),
    ):
        assert_refused(capsys, "name a file", *arguments)


def test_a_name_without_ending_is_a_folder_only_with_a_slash(capsys):
    quick = ("--epochs", 1, "--samples", 2000)
    assert_refused(
        capsys, "write new.safetensors for a file or new/", "fit", "gold.binary", "-o", "new"
    )
    assert run("fit", "gold.binary", "-o", "new/", *quick) == 0
    assert Path("new/gold.safetensors").exists()
    assert run("fit", "gold.binary", "-o", "new", *quick) == 0


def test_outputs_replace_only_what_they_may_unless_forced(capsys):
    before = Path("gold.binary").read_bytes()
    Path("gold.npz").write_bytes(b"mine")
    assert_refused(capsys, "use --force", "convert", "gold.binary", "-o", "gold.npz")
    assert run("convert", "gold.binary", "-o", "gold.npz", "--force") == 0
    assert run("convert", "gold.binary", "-o", "gold.npz") == 0
    assert_refused(
        capsys, "is the input as well", "fit", "gold.binary", "-o", "gold.binary", "--force"
    )
    assert Path("gold.binary").read_bytes() == before


def test_a_file_that_fails_costs_only_itself(capsys):
    Path("cut.binary").write_bytes(Path("gold.binary").read_bytes()[:-8])
    quick = ("--epochs", 1, "--samples", 2000)
    assert run("fit", "gold.binary", "cut.binary", *quick, "--json") == 1
    done = capsys.readouterr()
    first, second = json.loads(done.out)
    assert first["output"] == "gold.safetensors"
    assert first["size_bytes"] == Path("gold.safetensors").stat().st_size
    assert first["held_out_loss"] > 0.0
    assert second["file"] == "cut.binary"
    assert "cut.binary: " in second["error"]
    assert done.err.count("\n") == 1


def test_an_output_that_cannot_be_written_is_told_before_any_work(capsys):
    long = f"{'x' * 245}.binary"
    Path(long).write_bytes(Path("gold.binary").read_bytes())
    before = sorted(Path().iterdir())
    assert run("fit", "gold.binary", long) == 2
    assert "name too long" in capsys.readouterr().err.lower()
    assert sorted(Path().iterdir()) == before
