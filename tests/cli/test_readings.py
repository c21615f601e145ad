"""`nacre estimate --readings` and `nacre measure next` with readings."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import nacre
from nacre.errors import NacreError
from nacre.instruments import load_readings
from nacre.latent.estimates import COUNT, plausible
from tests.cli.support import assert_refused, run, run_json

TABLE = "instrument,geometry,value,L*,a*,b*\ngloss,60,37.7,,,\nsphere,SCI,,87.4,-2.1,-0.7\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("readings.csv").write_text(TABLE, "utf-8")
    return tmp_path


@pytest.mark.slow
def test_an_estimate_says_what_is_known_and_what_is_open(capsys, folder):
    found = run_json(capsys, "estimate", "--readings", "readings.csv", "-o", "satin.json")
    first = found["predictions"][0]
    assert (first["instrument"], first["geometry"]) == ("gloss", "60")
    assert first["low"][0] < 37.7 < first["high"][0]
    assert found["known_from_readings"] == 2
    assert found["doubtful"] == []
    assert found["next"]["error"] < found["expected_error"]
    assert "values" in json.loads(Path("satin.json").read_text("utf-8"))
    assert (
        run("estimate", "--readings", "readings.csv", "-o", "satin.safetensors", quiet=False) == 0
    )
    printed = capsys.readouterr()
    assert "would tell most" in printed.err
    assert "f_r is known within a factor of" in printed.err
    assert "from 2 readings: albedo" in printed.out
    network = nacre.load("satin.safetensors")
    assert len(plausible(network)) == COUNT
    assert run_json(capsys, "info", "satin.safetensors")[0]["known_from_readings"] == 2


@pytest.mark.slow
def test_the_next_readings_are_rows_to_fill_in(capsys, folder):
    call = "measure", "next", "readings.csv", "-n", 2, "--instruments", "gloss,haze"
    found = run_json(capsys, *call, "-o", "more.csv")
    assert {each["instrument"] for each in found["next"]} <= {"gloss", "haze"}
    now, *later = found["expected_error"], *found["expected_error_after"]
    assert now > later[0] > later[1]
    assert len(Path("more.csv").read_text("utf-8").splitlines()) == 1 + 2 + 2
    assert len(load_readings("more.csv")) == 2


def test_wrong_calls_are_refused(capsys, folder):
    Path("cut.csv").write_text(TABLE[:44], "utf-8")
    estimate = "estimate", "-o", "x.json"
    assert_refused(capsys, "name the photographs, or give --readings", *estimate)
    assert_refused(
        capsys, "takes the place", *estimate, "readings.csv", "--readings", "readings.csv"
    )
    assert_refused(capsys, "cut.csv", *estimate, "--readings", "cut.csv")
    following = "measure", "next", "readings.csv"
    assert_refused(capsys, "--step is for scattered", *following, "--step", 5)
    assert_refused(capsys, "did you mean gloss", *following, "--instruments", "glos")


def test_the_verb_takes_photographs_or_readings(folder):
    with pytest.raises(NacreError, match="not both"):
        nacre.estimate("photo.exr", readings="readings.csv")
    with pytest.raises(NacreError, match="one reading or more"):
        nacre.estimate(readings=[])
