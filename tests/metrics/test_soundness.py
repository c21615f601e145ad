"""What physical figures mean: usual for measurements, or wrong, with what to do about it."""

from __future__ import annotations

from typing import Any

import pytest

import nacre
from nacre.metrics import physical_facts
from nacre.metrics.soundness import conclusion, findings, percent
from tests.data import require_data
from tests.mitsuba.reflectances import Constant, Tilted


def said(formula: bool = False, **changes: Any) -> str:
    facts = {
        "largest albedo": [0.5, 0.4, 0.3],
        "largest albedo at": [85.0, 80.0, 0.0],
        "energy": "nowhere above 1, found by integration",
        "reciprocity": "found by integration",
        "reciprocity error": 0.04,
        "unknown pairs": 0.0,
    }
    changed = {name.replace("_", " "): value for name, value in changes.items()}
    return conclusion(findings(facts | changed, "a.bsdf", formula=formula))


EXCEEDS = {"energy": "exceeds 1: red at 85 degrees, found by integration"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {},
            "Nothing is wrong. It reflects at most 50 % of the light. It changes by 4 % when light",
        ),
        ({"largest_albedo": [0.992] * 3}, "at most 99.2 % of the light"),
        (
            {"energy": "nowhere above 1, certified: at most 0.5"},
            "of the light, which is certified.",
        ),
        (
            {"largest_albedo": [1.156, 1.1, 1.0], **EXCEEDS},
            "Nothing is wrong. It reflects up to 1.16 times the light it receives (red, 85 "
            "degrees): usual for measurements near the horizon, which reach 1.2.",
        ),
        (
            {"largest_albedo": [1.0, 1.05, 1.0], "largest_albedo_at": [0.0, 5.0, 0.0], **EXCEEDS},
            "(green, 5 degrees): within the error of measurements, which reach 1.2.",
        ),
        (
            {"largest_albedo": [1.05] * 3, "formula": True, **EXCEEDS},
            "(85 degrees): some formulas do.",
        ),
        (
            {"largest_albedo": [1.8, 1.2, 1.0], **EXCEEDS},
            "Something looks wrong. It reflects up to 1.8 times the light it receives (red, 85 "
            "degrees); nacre fit a.bsdf --physical makes a network that does not.",
        ),
        ({"largest_albedo": [31.0] * 3, **EXCEEDS}, "Check the unit of its values: f_r in 1/sr"),
        (
            {"largest_albedo": [None, 0.1, 0.1], **EXCEEDS},
            "Something looks wrong. It reflects without",
        ),
        ({"largest_albedo": [0.0] * 3}, "Something looks wrong. It reflects nothing."),
        ({"reciprocity": "by construction"}, "It is reciprocal by construction."),
        ({"reciprocity_error": 1e-9}, "It is reciprocal."),
        ({"reciprocity_error": None}, "It reflects at most 50 % of the light."),
        (
            {"reciprocity_error": 0.13},
            "changes by 13 % when light and viewer change places: usual for",
        ),
        ({"reciprocity_error": 0.13, "formula": True}, "change places: some formulas do."),
        ({"reciprocity_error": 0.79}, "Something looks wrong. It changes by 79 %"),
        ({"reciprocity_error": 0.79}, "check that light and viewer are not mixed up."),
        (
            {"unknown_pairs": 0.83},
            "It is known at 17 % of pairs of directions, and black at others.",
        ),
        ({"values_below_0": 0.125}, "12 % of its values are below 0, and count as 0."),
    ],
)
def test_figures_have_words(changes, words):
    assert words in said(**changes)


def test_what_is_wrong_comes_first():
    text = said(largest_albedo=[1.1] * 3, reciprocity_error=0.9, unknown_pairs=0.5, **EXCEEDS)
    places = [text.index(words) for words in ("90 %", "1.1 times", "known at 50 %")]
    assert places == sorted(places)


def test_materials_are_judged_by_these():
    assert conclusion(findings(physical_facts(Constant(0.5)))).startswith("Nothing is wrong.")
    assert "(red, " in conclusion(findings(physical_facts(Constant(1.5, 1.0, 1.0))))
    assert not any(found.wrong for found in findings(physical_facts(Tilted(0.2))))


def test_satin_gains_energy_as_measurements_do():
    facts = physical_facts(nacre.load(require_data("rgl", "satin_rosaline_rgb.bsdf")))
    text = conclusion(findings(facts))
    assert text.startswith(
        "Nothing is wrong. It reflects up to 1.16 times the light it receives (red"
    )


def test_shares_have_few_digits():
    shares = (0.037, 0.13, 0.992, 1.0, 1.5, 0.0004)
    assert [percent(x) for x in shares] == ["3.7 %", "13 %", "99.2 %", "100 %", "150 %", "0.04 %"]
