"""Each planted fault is found by its own property, and what is sound passes."""

from __future__ import annotations

import pytest

from nacre.soundness import PROPERTIES, Plan, Report, check, subject
from tests.soundness.faults import FAULTS, Plain, TooBright, WithCosine

QUICK = Plan(samples=1 << 16)
FOLLOW = {
    "density off by 3 %": {"chi-square", "area"},
    "density off by 3 % to either side": {"normalization", "area"},
    "density of another sampler": {"normalization", "area"},
    "NaN at grazing": {"weights", "gradients"},
    "rough GGX with the cosine": {"reciprocity"},
    "Lambert with the cosine": {"reciprocity"},
}
"""Other properties that a fault may violate too."""


def test_what_is_sound_passes_everything() -> None:
    report = check(subject(Plain()), QUICK)
    assert [result.property for result in report.results] == list(PROPERTIES)
    assert {result.state for result in report.results} == {"passed"}
    assert report.sound
    assert all(result.where is None for result in report.results)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_by_its_property(fault: str) -> None:
    make, name = FAULTS[fault]
    report = check(subject(make()), QUICK)
    found = report[name]
    assert found.state == "failed"
    assert found.size is not None
    assert found.limit is not None
    assert not found.size <= found.limit
    assert found.where is not None
    assert {each.property for each in report.failures} - {name} <= FOLLOW.get(fault, set())


def test_the_same_seed_gives_the_same_report() -> None:
    def report(seed: int) -> Report:
        names = ["energy", "reciprocity", "chi-square", "area"]
        return check(subject(TooBright()), Plan(samples=5000, seed=seed), names)

    assert report(1).facts() == report(1).facts()
    assert report(1).facts() != report(2).facts()


def test_a_fault_that_is_declared_is_by_design() -> None:
    fault = TooBright()
    fault.by_design = {"energy": "it glows"}  # type: ignore[attr-defined]
    report = check(subject(fault), only=["energy"])
    assert report["energy"].state == "by design"
    assert report["energy"].sentence.endswith("By design: it glows.")
    assert report.sound


def test_a_cosine_is_named_where_reciprocity_fails() -> None:
    report = check(subject(WithCosine()), only=["reciprocity"])
    assert "The factor cos(theta_i), or 1 / cos(theta_o) explains it." in (
        report["reciprocity"].sentence
    )
