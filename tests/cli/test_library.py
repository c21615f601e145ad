"""`nacre fit` of folders."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

import nacre
from tests.cli.support import run
from tests.workflows.support import contents, lines, table

QUICK = ["--hidden", "4", "--epochs", "1", "--samples", "1000"]

KILLED = """
import sys, time
from pathlib import Path
from nacre.cli import main
replace = Path.replace
def stuck(self, target):
    if Path(target).name == "c.safetensors":
        print("stuck", flush=True)
        time.sleep(600)
    return replace(self, target)
Path.replace = stuck
main(sys.argv[1:])
"""
"""A run that stops for ever with one material written, but not yet under its name."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b", "sub/a"):
        table(tmp_path / f"in/{name}.binary")
    return tmp_path


def test_a_folder_is_fitted_and_fitted_again_only_where_it_changed(folder, capsys):
    assert run("fit", "in", "--output", "lib", *QUICK) == 0
    done = capsys.readouterr()
    assert (done.out, done.err) == ("lib: 3 fitted\n", "")
    table(folder / "in/b.binary", 9)
    assert run("fit", "in", "-o", "lib", *QUICK) == 0
    assert capsys.readouterr().out == "lib: 1 fitted, 2 unchanged\n"
    assert nacre.load("lib/sub/a.safetensors").metadata["source"]["file"] == "a.binary"


def test_failures_are_listed_at_the_end_with_exit_code_1(folder, capsys):
    (folder / "in/bad.binary").write_bytes(b"bad")
    table(folder / "in/short.binary").write_bytes((folder / "in/a.binary").read_bytes()[:-8])
    assert run("fit", "in", "-o", "lib", *QUICK) == 1
    done = capsys.readouterr()
    assert done.out == "lib: 3 fitted, 2 failed\n"
    first, second = done.err.splitlines()
    assert first.startswith("nacre: bad.binary: is of no known format")
    assert second.startswith("nacre: short.binary: ")
    assert "the file is cut short" in second


def test_what_has_the_ending_of_measurements_and_is_none_is_named(folder, capsys):
    for index in range(7):
        (folder / f"in/{index}.bin").write_bytes(bytes(100))
    assert run("fit", "in", "-o", "lib", *QUICK) == 0
    done = capsys.readouterr()
    assert done.out == "lib: 3 fitted\n"
    names = "0.bin, 1.bin, 2.bin, 3.bin, 4.bin, and 2 more"
    assert done.err == f"nacre: left out, not measurements: {names}\n"


def test_analytic_models_and_files_beside_folders(folder, capsys):
    table(folder / "lone.binary")
    options = ["--model", "lambert", "--samples", "1000"]
    assert run("fit", "in", "lone.binary", "-o", "lib", *options) == 0
    assert capsys.readouterr().out == "lib: 4 fitted\n"
    assert set(contents(folder / "lib")) == {
        "library.jsonl",
        *(f"{name}.json" for name in ("a", "b", "sub/a", "lone")),
    }


@pytest.mark.slow
def test_a_local_cluster_is_started_and_its_dashboard_told(folder, capsys):
    pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    assert run("fit", "in", "-o", "here", *QUICK) == 0
    capsys.readouterr()
    (folder / "in/bad.binary").write_bytes(b"bad")
    assert (
        run("fit", "in", "-o", "lib", "--scheduler", "local", "--jobs", "1", *QUICK, quiet=False)
        == 1
    )
    done = capsys.readouterr()
    assert done.out == "lib: 3 fitted, 1 failed\n"
    (link,) = (line for line in done.err.splitlines() if line.startswith("dashboard"))
    failure = done.err.splitlines()[-1]
    assert re.fullmatch(r"dashboard: http://127\.0\.0\.1:\d+/status", link)
    assert failure.startswith("nacre: bad.binary: is of no known format")
    fits = contents(folder / "here")
    del fits["library.jsonl"]
    assert fits.items() <= contents(folder / "lib").items()


def test_without_an_output_fits_go_here(folder, capsys):
    assert run("fit", "in/sub", *QUICK) == 0
    assert capsys.readouterr().out == ".: 1 fitted\n"
    assert (folder / "a.safetensors").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["in", "-o", "x.safetensors"], "x.safetensors: must be a folder"),
        (["in", "-o", "x.h5"], "x.h5: must be a folder"),
        (["empty", "-o", "lib"], "empty: no measured materials found"),
        (["in", "absent.binary", "-o", "lib"], "absent.binary: no such file"),
        (["in", "in/sub/../../twin", "-o", "lib"], "same name as"),
        (["in", "--model", "ggx", "--preset", "draft"], "--preset is for networks"),
        (["in", "--scheduler", "host"], "'host' is neither local nor like tcp://host:8786"),
        (["in", "--scheduler", "tcp://host:1", "--jobs", "2"], "--jobs is for this machine"),
        (["in", "--data", "path"], "--data is for a cluster"),
        (["in", "-o", "-"], "-o -: only one analytic model"),
    ],
)
def test_wrong_usage_says_so_and_makes_nothing(folder, capsys, arguments, words):
    (folder / "empty").mkdir()
    table(folder / "twin/a.binary")
    before = sorted(folder.rglob("*"))
    assert run("fit", *arguments, *([] if "--model" in arguments else QUICK)) == 2
    error = capsys.readouterr().err
    assert error.startswith("nacre: ")
    assert error.count("\n") == 1
    assert words in error
    assert sorted(folder.rglob("*")) == before


@pytest.mark.slow
def test_a_killed_run_is_taken_up_where_it_stopped(folder):
    for name in ("c", "d", "e"):
        table(folder / f"in/{name}.binary")
    arguments = ["fit", "in", "-o", "lib", "--jobs", "1", *QUICK]
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, "-q", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "stuck\n"
        assert run(*arguments) == 2  # it holds the folder as long as it lives
        process.kill()
    left = contents(folder / "lib")
    assert ".library.lock" in left
    assert any(name.startswith(".") and name.endswith(".safetensors") for name in left)
    before = lines(folder / "lib")
    assert [line["source"] for line in before if line["error"]] == [
        "a.binary",
        "b.binary",
        "c.binary",
    ]
    finished = {line["source"]: line for line in before if not line["error"]}
    assert set(finished) == {"a.binary", "b.binary"}
    assert run(*arguments) == 0
    sources = [line["source"] for line in lines(folder / "lib")]
    names = ["a", "b", "c", "d", "e", "sub/a"]
    assert sources == [f"{name}.binary" for name in names]
    assert all(line in lines(folder / "lib") for line in finished.values())
    made = contents(folder / "lib")
    assert set(made) == {"library.jsonl", *(f"{name}.safetensors" for name in names)}
    assert all(made[name] == left[name] for name in ("a.safetensors", "b.safetensors"))
