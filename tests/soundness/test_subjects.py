"""Materials of every origin that are sound pass, and what cannot be checked is said."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic.lambert import Lambert
from nacre.errors import NacreError
from nacre.neural.chain import ChainBrdf
from nacre.numerics.mlp import Layer
from nacre.soundness import Plan, Report, check, subject
from nacre.soundness.making import in_scene
from tests.soundness.faults import GLOSSY
from tests.tiers import tiered
from tests.variants import require_mitsuba

QUICK = Plan(samples=1 << 15)
WHITE = Lambert(diffuse=(1.0, 0.5, 0.2), name="white")
MITSUBA: dict[str, dict[str, Any]] = {
    "diffuse": {"type": "diffuse"},
    "roughconductor": {"type": "roughconductor", "alpha": 0.15, "material": "Au"},
    "near mirror": {"type": "roughconductor", "alpha": 0.002},
    "anisotropic": {"type": "roughconductor", "alpha_u": 0.4, "alpha_v": 0.1},
    "plastic": {"type": "plastic"},
}


def states(report: Report) -> dict[str, str]:
    return {result.property: result.state for result in report.results}


@pytest.mark.parametrize(
    "brdf", [pytest.param(WHITE, marks=pytest.mark.slow, id="lambert"), GLOSSY]
)
def test_analytic_models_pass_everything(brdf: nacre.Brdf) -> None:
    require_mitsuba()
    assert set(states(check(subject(brdf), QUICK)).values()) == {"passed"}


@pytest.mark.slow
def test_a_bundled_network_is_sound_but_not_reciprocal_by_design() -> None:
    report = check(subject(nacre.load("rgl:paper_white")), QUICK)
    assert report.sound
    assert {name for name, state in states(report).items() if state != "passed"} == {"reciprocity"}
    assert report["reciprocity"].state == "by design"
    assert "measurements" in report["reciprocity"].sentence


def test_errors_of_measurements_excuse_a_little_energy() -> None:
    """What reflects 1.1 times the light may be a measurement; 1.5 times is wrong."""
    for share, state in ((1.1, "by design"), (1.5, "failed")):
        layer = Layer(np.zeros((6, 3)), np.full(3, share / math.pi))
        found = check(subject(ChainBrdf([layer], [""])), Plan(), ["energy"])
        assert found["energy"].state == state
        assert found["energy"].size == pytest.approx(share, rel=1e-3)


@pytest.mark.parametrize("name", tiered(MITSUBA, ["diffuse", "near mirror"]))
def test_what_mitsuba_has_passes(name: str) -> None:
    require_mitsuba()
    report = check(subject(MITSUBA[name], name), QUICK)
    assert report.name == name
    found = states(report)
    isotropy = found.pop("isotropy")
    assert isotropy == ("not applicable" if name == "anisotropic" else "passed")
    assert set(found.values()) == {"passed"}, found


def test_eval_of_a_near_mirror_is_checked_where_a_chi_square_test_sees_one_cell() -> None:
    """A density that is a quarter too low, at 0.05 degrees from the mirror direction."""
    sharp = nacre.analytic.MODELS["ggx"](
        diffuse=(0.0, 0.0, 0.0), specular=(1.0, 1.0, 1.0), roughness=0.001
    )

    class Low:
        def eval(self, wi: Any, wo: Any) -> Any:
            return sharp.eval(wi, wo)

        def sample(self, wo: Any, u: Any) -> Any:
            wi, pdf = sharp.sample(wo, u)
            return wi, np.where(pdf > 0.0, self.pdf(wi, wo), 0.0)

        def pdf(self, wi: Any, wo: Any) -> Any:
            pdf = sharp.pdf(wi, wo)
            return pdf * np.where(pdf > 1e4, 0.75, 1.0)

    assert check(subject(sharp), QUICK, ["area"]).sound
    assert check(subject(Low()), QUICK, ["area"])["area"].state == "failed"


def test_a_scene_has_its_bsdfs_by_their_ids(tmp_path: Path) -> None:
    require_mitsuba()
    scene = tmp_path / "scene.xml"
    scene.write_text(
        '<scene version="3.0.0"><bsdf type="diffuse" id="wall"/>'
        '<shape type="sphere"><bsdf type="roughplastic" id="ball"/></shape></scene>'
    )
    names = ["finite", "energy"]
    assert check(in_scene(scene, "wall"), QUICK, names).sound
    assert check(in_scene(scene, "ball"), QUICK, names).name == f"{scene}#ball"
    with pytest.raises(nacre.FormatError, match=r"has no BSDF 'door' \(found: .*ball"):
        in_scene(scene, "door")
    with pytest.raises(nacre.FormatError, match="has not just one BSDF; name one"):
        in_scene(scene)


def test_a_bsdf_in_memory_is_checked_in_its_variant() -> None:
    mi = require_mitsuba()
    report = check(subject(mi.load_dict({"type": "diffuse"}), "mine"), QUICK)
    assert report["variants"].state == "not applicable"
    assert report["weights"].state == "passed"


def test_what_an_object_lacks_is_not_applicable() -> None:
    class Values:
        def eval(self, wi: Any, wo: Any) -> Any:
            return np.full(len(wi), 0.3)

    found = states(check(subject(Values()), QUICK))
    assert {name for name, state in found.items() if state == "passed"} == {
        *("finite", "positive", "energy", "reciprocity", "no-cosine"),
    }
    assert set(found.values()) == {"passed", "not applicable"}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (3.0, r"float: has no method eval\(wi, wo\) to check"),
        (nacre.load("captured:leather"), "is a texture; check takes BSDFs"),
        ({"type": "dielectric"}, "dielectric: reflects only in single directions, or not at all"),
        ({"type": "sphere"}, "sphere: is not a BSDF"),
        ({"type": "roughcondoctor"}, "roughcondoctor: Mitsuba: .*roughcondoctor"),
    ],
)
def test_what_cannot_be_checked_is_said(given: Any, message: str) -> None:
    require_mitsuba()
    with pytest.raises(NacreError, match=message):
        subject(given)


def test_a_bsdf_of_another_variant_is_refused() -> None:
    mi = require_mitsuba()
    with mi.variant_context("scalar_rgb"):
        scalar = mi.load_dict({"type": "diffuse"})
    with pytest.raises(NacreError, match="is not a BSDF of llvm_ad_rgb; make it in that variant"):
        subject(scalar)


def test_values_of_a_wrong_shape_are_named() -> None:
    class Flat:
        def eval(self, wi: Any, wo: Any) -> Any:
            return np.zeros((3, len(wi)))

    with pytest.raises(NacreError, match=r"eval gives values of shape \(3, .*expected \(n,\)"):
        check(subject(Flat()), QUICK, ["energy"])


def test_an_unknown_property_is_answered_with_similar_ones() -> None:
    with pytest.raises(NacreError, match="enrgy: is not a property; did you mean energy"):
        check(subject(WHITE), only=["enrgy"])
