"""`nacre bench`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import nacre
from nacre.analytic import MODELS
from tests.cli.support import assert_refused, run, run_json
from tests.data import require_data

pytest.importorskip("skimage", reason="needs the extra 'render'")

CHOICE = "--only", "rgl:paper_white", "--methods", "truth,published,lambert", "--quick"


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_results_are_added_to_and_printed_as_a_table(capsys: Any) -> None:
    assert run("bench", *CHOICE, quiet=False) == 0
    printed = capsys.readouterr()
    assert printed.out == (
        "bench-included.jsonl: 3 rows measured, 0 there already, 1 without a result\n"
    )
    assert "left out: published for rgl:paper_white: is for measured tables" in printed.err
    before = Path("bench-included.jsonl").read_text()
    rows = [json.loads(line) for line in before.splitlines()]
    assert [row["method"] for row in rows] == ["truth", "published", "lambert"]
    assert rows[2]["command"] == (
        "nacre bench --split included --methods lambert --only rgl:paper_white --quick"
    )
    assert rows[2]["versions"]["nacre-materials"]
    assert rows[2]["machine"]["cores"] >= 1

    found = run_json(capsys, "bench", *CHOICE)
    assert [row["key"] for row in found["rows"]] == [row["key"] for row in rows]
    assert Path("bench-included.jsonl").read_text() == before  # nothing is measured again

    assert run("bench", "--show", "bench-included.jsonl") == 0
    table = capsys.readouterr().out
    assert table.startswith("## included, protocol quick, 1 materials\n\n| method | materials |")
    assert "\n| `lambert` | 1 | 12 |" in table
    assert table.endswith(
        "- `published`: is for measured tables of the RGL database (rgl:paper_white)\n"
    )
    Path("cut.jsonl").write_text(before[:300])
    assert_refused(capsys, "cut.jsonl: has no complete row", "bench", "--show", "cut.jsonl")
    # A row is measured again by its own command: the figures are the same, times are not.
    words = rows[2]["command"].split()[1:]
    assert run(*words, "-o", "again.jsonl") == 0
    again = json.loads(Path("again.jsonl").read_text())
    timed = {"fit_s", "fit_cpu_s", "eval_ns"}
    for key, value in rows[2]["measures"].items():
        assert key in timed or again["measures"][key] == value


def test_measured_files_are_judged(capsys: Any) -> None:
    folder = require_data("rgl", "paper_white_rgb.bsdf").parent
    words = "--split", "rgl", "--measured", folder, "--only", "paper_white", "--quick"
    found = run_json(capsys, "bench", *words, "--methods", "published")
    (row,) = found["rows"]
    assert row["unavailable"] is None
    assert row["measures"]["environment_psnr_db"] > 35.0
    assert row["measures"]["fit_cpu_s"] is None
    assert row["missing"] == dict.fromkeys(["fit_s", "fit_cpu_s"], "was fitted by its authors")
    assert row["command"].endswith("--measured FOLDER --quick")


def test_any_files_are_judged(capsys: Any) -> None:
    Path("mine/deep").mkdir(parents=True)
    nacre.save(MODELS["lambert"](diffuse=(0.2, 0.3, 0.4)), "mine/deep/gray.bin")
    Path("mine/notes.exr").write_bytes(b"no picture")
    words = "bench", "mine", "--quick", "--methods", "lambert,pca-refined"
    assert run(*words, quiet=False) == 0
    printed = capsys.readouterr()
    assert (
        printed.out == "bench-files.jsonl: 2 rows measured, 0 there already, 1 without a result\n"
    )
    assert "no other materials to learn codes from" in printed.err
    found = run_json(capsys, *words)  # nothing is measured again
    assert {row["split"] for row in found["rows"]} == {"files in mine"}
    assert {row["material"] for row in found["rows"]} == {"deep/gray"}
    assert found["rows"][0]["command"] == (
        "nacre bench FILES --methods lambert --only deep/gray --quick"
    )
    assert len(Path("bench-files.jsonl").read_text().splitlines()) == 2
    assert_refused(capsys, "--split is for the splits", *words, "--split", "rgl")
    assert_refused(capsys, "is not a material of the files (deep/gray)", *words, "--only", "gray")
    Path("mine/bad.bsdf").write_text("no table")
    assert_refused(capsys, "mine/bad.bsdf", *words)
    Path("empty").mkdir()
    assert_refused(capsys, "empty: no measured materials found", "bench", "empty")


def test_splits_methods_and_measures_are_listed(capsys: Any) -> None:
    assert run("bench", "--list") == 0
    printed = capsys.readouterr().out
    for name in ("merl-networks-2", "enhanced-675-best", "file.mbsdf", "reciprocity_error"):
        assert f"  {name} " in printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--split", "none"), "'none' is not a split (known: included, "),
        (("--methods", "magic"), "'magic' is not a method"),
        (("--only", "chrome"), "'chrome' is not a material of the split included"),
        (("--split", "rgl"), "rgl: needs acrylic_felt_green_rgb.bsdf; 'nacre download"),
        (("-o", "none/out.jsonl"), "none/out.jsonl: folder none does not exist"),
        (("--show", "none.jsonl"), "none.jsonl: no such file"),
        (("--show", __file__, "--quick"), "leave out --quick"),
    ],
)
def test_bad_input_is_refused_in_one_line(capsys: Any, words: Any, message: str) -> None:
    assert_refused(capsys, message, "bench", *words)


def test_a_file_of_the_users_stays(capsys: Any) -> None:
    Path("bench-included.jsonl").write_text("my notes\n")
    assert_refused(capsys, "use --force to replace it", "bench", *CHOICE)
    assert Path("bench-included.jsonl").read_text() == "my notes\n"
    assert_refused(capsys, "holds no results", "bench", "--show", "bench-included.jsonl")
