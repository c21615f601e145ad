"""`nacre materials`, and commands on the names that it lists."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.shell_completion import ShellComplete

import nacre
from nacre.cli import root
from tests.cli.support import assert_refused, run, run_json


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_they_are_listed_with_source_terms_and_error(capsys: Any) -> None:
    (found,) = run_json(capsys, "materials", "rgl:paper_white", "a4")
    assert found["title"] == "White A4 paper (160 gsm)"
    assert "epfl" in found["source"]
    assert found["terms"].startswith("CC0")
    assert found["psnr_db"]["environment"] > 40.0
    assert found["size_bytes"] == nacre.materials("rgl:paper_white", "a4")[0].nbytes
    assert run("materials", "chrome") == 0
    printed = capsys.readouterr().out
    assert "merl:chrome" in printed
    assert "unknown" in printed
    assert "MIT" in printed


def test_a_word_that_none_has_is_an_error(capsys: Any) -> None:
    assert_refused(capsys, "has adamantium in its name", "materials", "adamantium")


def test_commands_take_a_name_in_place_of_a_file(capsys: Any) -> None:
    (facts,) = run_json(capsys, "info", "merl:chrome", "--no-physics")
    assert facts["name"] == "chrome"
    assert "MIT" in facts["terms"]
    assert facts["rounding_psnr_db"] > 40.0
    assert run("convert", "rgl:paper_white", "-o", "paper.safetensors") == 0
    assert nacre.load("paper.safetensors").name == "White A4 paper (160 gsm)"
    assert run("export", "nielsen:bluebook", "--to", "glsl") == 0
    assert run("view", "rgl:paper_white", "nbrdf-rgl:paper_white", "-o", "page.html") == 0
    names = {path.name for path in Path().iterdir()}
    assert {"paper.safetensors", "page.html"} < names
    assert any(name.startswith("bluebook") for name in names)


def test_a_name_with_a_mistake_is_refused(capsys: Any) -> None:
    assert_refused(capsys, "did you mean rgl:paper_white", "render", "rgl:paper_wite")


def test_names_are_completed_once_there_is_a_colon() -> None:
    complete = ShellComplete(root, {}, "nacre", "_NACRE_COMPLETE")
    found = [item.value for item in complete.get_completions(["render"], "rgl:pa")]
    assert found == ["rgl:paper_white"]
    assert [item.type for item in complete.get_completions(["render"], "rgl")] == ["file"]
