"""`nacre check`: tables, exit codes, pages, and what it takes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import nacre
from nacre.analytic.lambert import Lambert
from tests.cli.support import run
from tests.soundness.faults import GLOSSY, TooBright, WithCosine
from tests.variants import require_mitsuba

FEW = ("--samples", "5000", "--only", "energy,reciprocity,chi-square")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    nacre.save(GLOSSY, tmp_path / "glossy.json")
    nacre.save(Lambert(diffuse=(1.05, 0.5, 0.5)), tmp_path / "bright.json")
    return tmp_path


def test_what_is_sound_gives_a_table_and_exit_code_0(folder: Path, capsys: Any) -> None:
    assert run("check", "glossy.json", *FEW) == 0
    out = capsys.readouterr().out
    assert out.startswith("glossy.json is sound\n")
    assert [line.split()[0] for line in out.splitlines()[2:5]] == FEW[3].split(",")


def test_a_failure_gives_its_size_and_place_and_exit_code_1(folder: Path, capsys: Any) -> None:
    assert run("check", "bright.json", "glossy.json", *FEW) == 1
    out = capsys.readouterr().out
    assert "bright.json fails energy\n" in out
    assert "energy: Albedo 1.05 ± " in out
    assert "Worst at light " in out


def test_json_has_every_property(folder: Path, capsys: Any) -> None:
    assert run("check", "bright.json", "--json", *FEW) == 1
    (found,) = json.loads(capsys.readouterr().out)
    assert found["input"] == "bright.json"
    assert found["sound"] is False
    energy = found["properties"][0]
    assert (energy["property"], energy["state"], energy["limit"]) == ("energy", "failed", 1.005)
    assert energy["size"] == pytest.approx(1.05, abs=2e-3)
    assert set(energy["where"]) == {"theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"}
    assert all(each["where"] is None for each in found["properties"][1:])


def test_the_page_holds_all_its_pictures(folder: Path) -> None:
    assert run("check", "bright.json", "-o", "report.html", *FEW) == 1
    page = (folder / "report.html").read_text("utf-8")
    assert page.count('<img src="data:image/png;base64,') == 3
    assert "http" not in page
    assert '<td class="failed">failed</td>' in page
    assert run("check", "bright.json", "-o", "report.png", *FEW) == 2


def test_bsdfs_of_mitsuba_are_taken_by_name_description_and_id(folder: Path, capsys: Any) -> None:
    require_mitsuba()
    scene = folder / "scene.xml"
    scene.write_text(
        '<scene version="3.0.0"><bsdf type="diffuse" id="wall"/><bsdf type="plastic" id="ball"/>'
        "</scene>"
    )
    given = ("roughconductor", '{"type": "diffuse"}', "scene.xml#ball", "--only", "finite")
    assert run("check", *given) == 0
    names = [line for line in capsys.readouterr().out.splitlines() if line.endswith("is sound")]
    assert names == ["roughconductor is sound", "diffuse is sound", "scene.xml#ball is sound"]
    assert run("check", "scene.xml", "--bsdf", "wall", "--only", "finite") == 0


def test_a_plugin_of_ones_own_is_imported_first(folder: Path, capsys: Any) -> None:
    require_mitsuba()
    (folder / "own_bsdf.py").write_text(
        "import nacre, mitsuba as mi\n"
        "from nacre.analytic.lambert import Lambert\n"
        "gray = Lambert(diffuse=(0.5, 0.5, 0.5))\n"
        "mi.register_bsdf('own', lambda properties: nacre.mitsuba.bsdf(gray))\n"
    )
    assert run("check", "own", "--import", "own_bsdf", "--only", "energy") == 0
    assert "own is sound" in capsys.readouterr().out
    assert run("check", "own", "--import", "absent_module", "--only", "energy") == 2
    assert "--import absent_module: does not load" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["absent.binary"], "absent.binary: no such file"),
        (["rgl:paper_whit"], "did you mean rgl:paper_white"),
        (["nosuchbsdf"], "there is no such file, and Mitsuba has no BSDF of that name"),
        (["glossy.json", "--only", "enrgy"], "is not a property; did you mean energy?"),
        (["glossy.json", "--bsdf", "wall"], "is not a scene (.xml)"),
        (["{bad"], "the description: is no JSON"),
    ],
)
def test_bad_input_gives_one_line_and_exit_code_2(
    arguments: list[str], message: str, folder: Path, capsys: Any
) -> None:
    require_mitsuba()
    assert run("check", *arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_one_bad_input_among_several_gives_exit_code_1(folder: Path, capsys: Any) -> None:
    assert run("check", "absent.binary", "glossy.json", *FEW) == 1
    captured = capsys.readouterr()
    assert "glossy.json is sound" in captured.out
    assert "absent.binary: no such file" in captured.err


def test_the_verb_takes_objects_and_shows_itself(tmp_path: Path) -> None:
    found = nacre.check(WithCosine(), only=["reciprocity", "no-cosine"])
    assert not found.sound
    assert [each.property for each in found.failures] == ["reciprocity", "no-cosine"]
    assert repr(found).splitlines()[0] == "WithCosine: fails reciprocity, no-cosine"
    assert found["no-cosine"].state == "failed"
    assert found._repr_html_().count("<tr>") == 2
    assert found.save(tmp_path / "report.html").stat().st_size > 10_000
    assert nacre.check(TooBright(), only=["reciprocity"]).sound
