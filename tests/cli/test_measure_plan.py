"""`nacre measure plan` and `next`, and what is made of the few samples that they lead to."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.analytic import Ggx
from nacre.io.image_file import read_header
from nacre.latent.estimates import COUNT, plausible
from nacre.measured import merl
from tests.cli.support import assert_refused, run, run_json

TRUTH = Ggx(name="paint", diffuse=(0.3, 0.1, 0.05), specular=(0.05, 0.05, 0.05), roughness=0.2)


def fill(plan: str, measured: str) -> None:
    """Measure at the directions of a plan."""
    from nacre.geometry import from_spherical, join

    lines = []
    for line in Path(plan).read_text().splitlines():
        if line.endswith(",,,"):
            angles = np.radians([float(cell) for cell in line.split(",")[:4]])
            wi, wo = (join(from_spherical(*angles[k : k + 2])) for k in (0, 2))
            values = TRUTH.eval(np.array([wi]), np.array([wo]))[0]
            line = line[:-3] + "," + ",".join(f"{value:.6g}" for value in values)
        lines.append(line)
    Path(measured).write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plan") / "plan.csv"
    assert run("measure", "plan", "-n", 12, "-o", path) == 0
    return path


@pytest.fixture
def measured(plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    shutil.copy(plan, "plan.csv")
    fill("plan.csv", "paint.csv")
    return tmp_path / "paint.csv"


@pytest.mark.slow
def test_from_a_plan_to_a_network_with_its_uncertainty(capsys, measured):
    rows = [line for line in Path("plan.csv").read_text().splitlines() if line.endswith(",,,")]
    assert len(rows) == 12
    assert run("fit", "paint.csv", "--preset", "draft", "-o", "paint.safetensors") == 0
    assert "from 12 samples: albedo" in capsys.readouterr().out
    assert len(plausible(nacre.load("paint.safetensors"))) == COUNT
    (facts,) = run_json(capsys, "info", "paint.safetensors")
    assert facts["known_from_samples"] == 12
    low, high = facts["plausible_albedo_from"], facts["plausible_albedo_to"]
    assert all(a < b for a, b in zip(low, high, strict=True))
    assert run("plot", "paint.safetensors", "-o", "lobes.svg") == 0
    assert "bands hold 90 %" in Path("lobes.svg").read_text()


@pytest.mark.slow
def test_compare_shows_how_dark_and_bright_it_may_be(capsys, measured):
    nacre.save(merl.tabulate(TRUTH, merl.Resolution(30, 15, 15)), "truth.binary")
    for name, extra in (("few", ()), ("alone", ("--no-prior",))):
        assert (
            run("fit", "paint.csv", "--preset", "draft", "-o", f"{name}.safetensors", *extra) == 0
        )
    heights, figures = [], []
    for name in ("few", "alone"):
        found = run_json(
            capsys, "compare", "truth.binary", f"{name}.safetensors", "--size", 16, "-o", "c.png"
        )
        figures.append(found["figures"])
        heights.append(read_header("c.png").height)
    assert heights[0] > heights[1]
    assert 0.5 < figures[0]["plausible"]["pixels_in_their_90_interval"] <= 1.0
    assert "plausible" not in figures[1]
    assert figures[0]["environment"]["mae"] < figures[1]["environment"]["mae"]


def test_the_next_pairs_are_added_to_what_was_measured(capsys, measured):
    found = run_json(capsys, "measure", "next", "paint.csv", "-n", 3, "-o", "next.csv")
    assert found["samples"] == 12
    assert len(found["next"]) == len(found["expected_error_after"]) == 3
    assert found["expected_error_after"][-1] < found["expected_error"]
    fill("next.csv", "more.csv")
    assert len(nacre.load("more.csv").samples) == 15
    pair = found["next"][0]
    assert all(
        low < high
        for low, high in zip(pair["f_r_low_per_sr"], pair["f_r_high_per_sr"], strict=True)
    )
    again = run_json(capsys, "measure", "next", "more.csv", "-n", 1)
    assert again["expected_error"] < found["expected_error"]


def test_a_budget_and_an_error_end_it(capsys, measured):
    assert run("measure", "next", "paint.csv", "--budget", 12, quiet=False) == 0
    assert "the budget is spent" in capsys.readouterr().err
    assert run("measure", "next", "paint.csv", "--until", 0.9, quiet=False) == 0
    assert "below 0.9" in capsys.readouterr().err
    assert len(run_json(capsys, "measure", "next", "paint.csv", "--budget", 14)["next"]) == 2


def test_a_virtual_measurement(capsys, measured):
    nacre.save(TRUTH, "paint.json")
    assert run("measure", "plan", "-n", 12, "--of", "paint.json", "-o", "made.csv") == 0
    made, filled = (nacre.load(name).samples for name in ("made.csv", "paint.csv"))
    np.testing.assert_allclose(made.wo, filled.wo, atol=1e-6)
    np.testing.assert_allclose(made.rgb, filled.rgb, rtol=1e-3)


def test_pictures_of_a_camera(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    extra = "--field", "12,8", "--fixed-light", 30
    assert run("measure", "plan", "-n", 2, "-o", "p.csv", *extra) == 0
    text = Path("p.csv").read_text()
    assert "# rows of a picture: 9\n" in text
    rows = [line for line in text.splitlines() if line.endswith(",,,")]
    assert len(rows) == 18
    assert all(row.startswith("30,0,") for row in rows)


def test_encode_says_how_sure_it_is(capsys, measured):
    found = run_json(capsys, "latent", "encode", "paint.csv", "-o", "c.json")
    assert found["known_from_samples"] == 12
    assert len(json.loads(Path("c.json").read_text())["values"]) == 32
    scaled = run_json(capsys, "latent", "encode", "paint.csv", "--free-scale", "-o", "d.json")
    assert scaled["factor_of_the_instrument"] > 0.0


def test_what_is_refused(capsys, measured):
    refused = lambda words, *arguments: assert_refused(capsys, words, *arguments)  # noqa: E731
    refused("a plan is a .csv file", "measure", "plan", "-o", "p.txt")
    refused("beyond the largest polar", "measure", "plan", "--fixed-light", 85, "-o", "p.csv")
    refused("was changed since nacre wrote it", *filled_in_place())
    refused("is a plan that is not filled in", "measure", "next", "empty.csv")
    nacre.save(TRUTH, "ggx.json")
    refused("is not a measurement at scattered", "measure", "next", "ggx.json")
    refused("is for samples", "latent", "encode", "ggx.json", "--free-scale", "-o", "e.json")
    refused("needs the prior", "fit", "paint.csv", "--no-prior", "--free-scale", "-o", "n.h5")
    refused("expected a width and a height", "measure", "plan", "--field", "3", "-o", "p.csv")
    refused("did you mean nacre measure plan?", "measure", "pla")


def filled_in_place() -> tuple[object, ...]:
    """A command that would replace a plan that values were entered into."""
    for name in ("empty.csv", "filled.csv"):
        run("measure", "plan", "-n", 1, "-o", name)
    fill("filled.csv", "filled.csv")
    return "measure", "plan", "-n", 1, "-o", "filled.csv"
