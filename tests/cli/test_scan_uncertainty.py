"""A scan with apertures and uncertainties through the commands."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import nacre
from nacre.latent import bounds
from nacre.neural import ensemble
from tests.cli.support import assert_refused, run, run_json
from tests.measured.bird_schema import SCHEMA
from tests.neural.test_ensemble import scan


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ensemble, "COUNT", 4)
    nacre.save(scan(), "paint.csv")
    return tmp_path


def fitted(*more: object) -> int:
    fit = "fit", "paint.csv", "--preset", "draft", "--epochs", 20, "-o", "paint.safetensors"
    return run(*fit, *more)


@pytest.mark.slow
def test_intervals_come_out_wherever_a_material_is_told_about(capsys, folder):
    assert fitted("--intervals") == 0
    (facts,) = run_json(capsys, "info", "paint.safetensors")
    low, high = (facts[f"plausible_gloss_at_60_degrees_{end}"] for end in ("from", "to"))
    (_, at_60, _) = run_json(capsys, "measure", "gloss", "paint.safetensors")["gloss"]
    assert at_60["gloss_low_gu"] == pytest.approx(low[0], abs=1e-6)
    assert at_60["gloss_high_gu"] == pytest.approx(high[0], abs=1e-6)
    assert at_60["gloss_low_gu"] < at_60["gloss_high_gu"]
    for instrument in ("45-0", "sphere", "multiangle"):
        for color in run_json(capsys, "measure", instrument, "paint.safetensors")["colors"]:
            assert color["lab_low"][0] < color["lab_high"][0]
    haze = run_json(capsys, "measure", "haze", "paint.safetensors")
    assert haze["gloss_20_gu_low"] < haze["gloss_20_gu_high"]
    assert run("measure", "haze", "paint.safetensors") == 0
    assert "for 90 %" in capsys.readouterr().out
    assert run("plot", "paint.safetensors", "-o", "paint.svg") == 0
    assert "90 %" in Path("paint.svg").read_text("utf-8")


@pytest.mark.slow
def test_bird_files_with_uncertainties_meet_the_schemas(capsys, folder):
    assert fitted("--intervals") == 0
    assert run("convert", "paint.safetensors", "-o", "paint.bird.brdf") == 0
    document = json.loads(Path("paint.bird.brdf").read_text("utf-8"))
    jsonschema.validate(document, SCHEMA)
    data = document["data"]
    assert len(data["uBRDF"]["values"]) == len(data["BRDF"]["values"])
    again = nacre.load("paint.bird.brdf")
    low, high = bounds(nacre.load("paint.safetensors"), again.samples.wi, again.samples.wo, 0.6827)
    expected = 0.5 * (high - low).mean(axis=1)
    np.testing.assert_allclose(again.samples.sigma, expected, rtol=1e-3, atol=1e-6)


def test_bird_files_of_scans_keep_their_uncertainties(folder):
    measured = nacre.load("paint.csv")
    nacre.save(measured, "paint.bird.brdf")
    jsonschema.validate(json.loads(Path("paint.bird.brdf").read_text("utf-8")), SCHEMA)
    again = nacre.load("paint.bird.brdf")
    np.testing.assert_allclose(again.samples.sigma, measured.samples.sigma, rtol=1e-4)


def test_apertures_are_said_on_the_command_line(capsys, folder):
    (facts,) = run_json(capsys, "info", "paint.csv", "--apertures", "0.25,2.5")
    assert facts["detector_half_angle"] == "2.5 degrees"
    assert facts["uncertainty"].startswith("4.99% in the median")
    assert_refused(capsys, "SOURCE,DETECTOR", "fit", "paint.csv", "--apertures", "2.5")
    assert_refused(capsys, "SOURCE,DETECTOR", "fit", "paint.csv", "--apertures", "0,95")
    assert_refused(capsys, "scans", "info", "rgl:paper_white", "--apertures", "0,1")


def test_intervals_want_uncertainties(capsys, folder):
    nacre.save(scan(sigma=False), "plain.csv")
    assert run("fit", "plain.csv", "--preset", "draft", "--epochs", 1, "--intervals") == 2
    assert "intervals need its uncertainties: a column sigma" in capsys.readouterr().err
    assert_refused(capsys, "analytic model", "fit", "paint.csv", "--intervals", "--model", "ggx")
