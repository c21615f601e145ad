"""Places: what is closest is written, whatever its place in the list, and all is compared."""

from __future__ import annotations

import pytest

from nacre.errors import NacreError
from nacre.formats import load
from nacre.io.marks import Mark, read_mark
from nacre.metrics import compare
from nacre.standard.openpbr import OpenPbr
from nacre.targets import TARGETS, Target
from nacre.workflows import places
from nacre.workflows.places import PLACES, Representation, export_to_place
from tests.analytic.materials import EXAMPLES


class Matte(Target):
    """Holds the Lambertian part of a material."""

    title, model = "matte", "lambert"

    def files(self, material, name):
        return {f"{name}.txt": material.summary().encode()}


class Nothing(Target):
    title = "nothing"

    def files(self, material, name):
        raise NacreError("holds nothing")


@pytest.fixture
def _targets(monkeypatch):
    monkeypatch.setattr(TARGETS, "_members", {**TARGETS._members, "matte": Matte, "no": Nothing})
    matte, code = Representation("matte", "matte", "Read {name}.txt."), Representation(
        "code", "glsl", "Include {name}.glsl."
    )  # fmt: skip
    broken = Representation("nothing", "no", "Leave it.")
    known = {"somewhere": (broken, matte, code), "nowhere": (broken,)}
    monkeypatch.setattr(places, "PLACES", known)


@pytest.mark.usefixtures("_targets")
@pytest.mark.slow
def test_the_closest_is_written_with_a_readme(tmp_path):
    truth = EXAMPLES["ggx"].replaced(
        name="Red paint", source={"file": "red.binary", "terms": "CC0"}
    )
    found, paths = export_to_place(truth, "somewhere", tmp_path)
    assert [each.representation.title for each in found] == ["code", "matte"]
    assert found[0].flip == 0.0
    expected = compare(truth, found[1].held).lights
    assert found[1].flip == pytest.approx(sum(x.errors.flip for x in expected) / 2)
    assert [path.name for path in paths] == ["red_paint.glsl", "red_paint-readme.txt"]
    lines = paths[1].read_text().splitlines()
    assert lines[0] == "Include red_paint.glsl."
    assert "environment: FLIP 0.000" in lines[1]
    assert lines[2].startswith("Written by nacre export ")
    assert lines[2].endswith("from red.binary; terms: CC0.")
    assert read_mark(paths[1]) == Mark("nacre", True)


@pytest.mark.usefixtures("_targets")
def test_a_place_that_can_hold_nothing_says_why(tmp_path):
    with pytest.raises(NacreError, match="nowhere: nothing: holds nothing"):
        export_to_place(EXAMPLES["ggx"], "nowhere", tmp_path)


def test_what_is_written_is_the_material(tmp_path):
    truth = EXAMPLES["openpbr"]
    assert isinstance(truth, OpenPbr)
    found, paths = export_to_place(truth, "usd", tmp_path, name="x")
    assert found[0].flip < 1e-3
    written = load(next(path for path in paths if path.suffix == ".usda"))
    assert written.values == found[0].held.values


def test_places_name_targets_and_their_files():
    for representations in PLACES.values():
        for each in representations:
            assert each.target in TARGETS
            assert "{name}" in each.opening
