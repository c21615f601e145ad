"""`nacre measure gloss`, `haze`, `multiangle`, `sphere` and `45-0`."""

from __future__ import annotations

from pathlib import Path

import pytest

import nacre
from nacre.analytic import MODELS, Ggx
from tests.cli.support import assert_refused, run, run_json


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    facets = {"specular": (0.04, 0.04, 0.04), "roughness": 0.1}
    nacre.save(Ggx(name="red", diffuse=(0.5, 0.05, 0.05), **facets), "red.json")
    nacre.save(MODELS["lambert"](name="gray", diffuse=(0.5, 0.5, 0.5)), "gray.json")
    return tmp_path


def test_gloss_and_haze_are_reported_with_units(capsys, folder):
    found = run_json(capsys, "measure", "gloss", "red.json")
    assert [each["angle_deg"] for each in found["gloss"]] == [20, 60, 85]
    expected = nacre.instruments.gloss(nacre.load("red.json"), 60).value
    assert found["gloss"][1]["gloss_gu"] == pytest.approx(expected)
    haze = run_json(capsys, "measure", "haze", "red.json")
    assert haze["gloss_20_gu"] == pytest.approx(found["gloss"][0]["gloss_gu"])
    assert 0.0 < haze["compensated_haze_hu"] < haze["haze_hu"]
    assert run("measure", "gloss", "red.json") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split() == ["angle", "gloss,", "GU", "known"]
    assert lines[3].split() == ["60", f"{expected:.2f}", "100%"]
    assert run("measure", "haze", "red.json") == 0
    assert "log haze" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "first"), [("multiangle", "45as-15"), ("sphere", "di:8"), ("45-0", "45a:0")]
)
def test_colors_are_reported_and_compared(capsys, folder, name, first):
    found = run_json(capsys, "measure", name, "gray.json", "--standard", "red.json")
    assert found["illuminant"] == "D65"
    assert found["estimated"] is False
    assert found["known_fraction"] == 1.0
    color = found["colors"][0]
    assert color["geometry"] == first
    assert color["xyz"][1] == pytest.approx(50.0, rel=1e-4)
    assert color["ciede2000"] > 10.0
    assert run("measure", name, "gray.json") == 0
    assert "dE00" not in capsys.readouterr().out


def test_flop_index_and_views_outside_of_the_plane(capsys, folder):
    found = run_json(capsys, "measure", "multiangle", "red.json", "--angles", "E2539")
    assert len(found["colors"]) == 19
    assert found["flop_index"] > 0.0


def test_hemispherical_reflectance_at_given_angles(capsys, folder):
    found = run_json(capsys, "measure", "sphere", "gray.json", "--incidence", "0,60")
    assert [color["geometry"] for color in found["colors"]] == ["di:8", "de:8", "0:di", "60:di"]
    assert found["colors"][3]["xyz"][1] == pytest.approx(50.0, rel=1e-4)
    assert_refused(capsys, "up to 20 degrees", "measure", "sphere", "gray.json", "--incidence", 95)


def test_a_color_that_is_an_estimate_is_noted(capsys, folder):
    call = "measure", "45-0", "red.json", "--illuminant", "F11", "--observer", 10
    assert run_json(capsys, *call)["estimated"] is True
    assert run(*call, quiet=False) == 0
    assert "under F11 for 10 degrees is that of a smooth spectrum" in capsys.readouterr().err


def test_directions_that_were_not_measured_are_noted(capsys, folder):
    rows = ["# units: degrees", "# values: f_r in 1/sr", "theta_i,phi_i,theta_o,phi_o,r,g,b"]
    rows += [
        f"{i},0,{o},{phi},0.1,0.1,0.1"
        for i in (0, 20, 40)
        for o in (0, 20, 40)
        for phi in (0, 90, 180)
    ]
    Path("scan.csv").write_text("\n".join(rows) + "\n")
    assert run("measure", "gloss", "scan.csv", quiet=False) == 0
    captured = capsys.readouterr()
    assert "f_r is known at 0.0% of the directions" in captured.err
    assert captured.out.splitlines()[1].split()[-1] == "known"
    found = run_json(capsys, "measure", "gloss", "scan.csv")["gloss"]
    assert [each["known_fraction"] for each in found] == [1.0, 1.0, 0.0]


def test_colors_are_drawn(capsys, folder):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    call = "measure", "multiangle", "red.json", "--standard", "gray.json", "-o", "red.png"
    assert run_json(capsys, *call)["output"] == "red.png"
    assert Path("red.png").read_bytes().startswith(b"\x89PNG")
    assert_refused(capsys, "a plot ends in", *call[:-1], "red.gif")
    assert_refused(capsys, "red.json", *call[:-1], "red.json")


def test_a_single_wavelength_has_gloss_and_no_color(capsys, folder):
    rows = ["# units: degrees", "# values: f_r in 1/sr", "theta_i,phi_i,theta_o,phi_o,650 nm"]
    rows += [f"{i},0,{o},{phi},0.1" for i in (0, 30) for o in (0, 30) for phi in (0, 180)]
    Path("laser.csv").write_text("\n".join(rows) + "\n")
    assert run("measure", "gloss", "laser.csv", quiet=False) == 0
    assert "measured at 650 nm only" in capsys.readouterr().err
    assert_refused(capsys, "make no color (650 nm); colors cannot", "measure", "45-0", "laser.csv")
