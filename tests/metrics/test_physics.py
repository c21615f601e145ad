"""Energy, reciprocity and anisotropy against closed forms and Mitsuba."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import nacre
from nacre.brdf import Brdf
from nacre.metrics.facts import UNITS, physical_facts
from nacre.metrics.physics import albedo, anisotropy, known_fraction, reciprocity_error
from tests.data import require_data
from tests.mitsuba.reflectances import Constant, Lobe, Tilted
from tests.reflectances import Brushed
from tests.variants import require_mitsuba


class Partial(Constant):
    """Known only where both directions are high; what is not known is far off."""

    def eval_components(self, wi, wo):
        known = self.valid_components(wi, wo)
        return tuple(np.where(known, c, 100.0 * wi[2]) for c in super().eval_components(wi, wo))

    def valid_components(self, wi, wo):
        return (wi[2] > 0.5) & (wo[2] > 0.5)


class Waves(Constant):
    """1 + a cos(2 phi_i), times a constant: isotropic in the mean."""

    isotropic = False
    amplitude = 0.6

    def eval_components(self, wi, wo):
        wave = 1.0 + self.amplitude * np.cos(2.0 * np.arctan2(wi[1], wi[0]))
        return tuple(c * wave for c in super().eval_components(wi, wo))


class Turned(Brdf):
    """The mean of a reflectance over 16 turns of the surface."""

    def __init__(self, brdf: Brdf) -> None:
        self.brdf = brdf

    def eval_components(self, wi, wo):
        total = 0.0
        for angle in np.arange(16) * math.pi / 8:
            turned = [
                (
                    math.cos(angle) * x - math.sin(angle) * y,
                    math.sin(angle) * x + math.cos(angle) * y,
                    z,
                )
                for x, y, z in (wi, wo)
            ]
            total = total + np.stack(self.brdf.eval_components(*turned)) / 16
        return tuple(total)


def test_a_lambertian_albedo_is_exact():
    found = albedo(Constant(0.2, 0.5, 1.0), np.radians([0, 45, 89]), [0.0, 1.0, 4.0], count=64)
    np.testing.assert_allclose(found.value, [[0.2, 0.5, 1.0]] * 3, rtol=1e-12)
    assert found.error.max() < 1e-12


@pytest.mark.parametrize("exponent", [2.0, 100.0, 20000.0])
def test_the_albedo_of_a_half_vector_lobe_is_that_of_its_closed_form(exponent):
    # Seen from above, half vectors beyond 45 degrees send light below the horizon.
    expected = 1.0 - 0.5 ** ((exponent + 2.0) / 2.0)
    found = albedo(Lobe(exponent), 0.0)
    np.testing.assert_allclose(found.value, np.array([1.0, 0.5, 0.0]) * expected, rtol=2e-3)
    assert abs(found.value[0] - expected) < 5.0 * found.error[0]


def sampled_by_mitsuba(mi, description, angle):
    """The mean weight of a BSDF's own samples: its albedo."""
    import drjit as dr

    bsdf, count = mi.load_dict(description), 1 << 18
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, count)
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(math.sin(angle), 0.0, math.cos(angle))
    _, weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())
    return np.array(weight).mean(axis=1)


@pytest.mark.parametrize("alpha", [0.02, 0.15, 0.6])
def test_albedo_agrees_with_mitsubas_own_sampling(alpha):
    mi = require_mitsuba()
    from nacre.measuring.virtual import MitsubaBrdf

    description = {"type": "roughconductor", "alpha": alpha, "specular_reflectance": 0.8}
    angles = np.radians([0.0, 50.0, 80.0])
    found = albedo(MitsubaBrdf(description), angles, count=2048).value
    expected = [sampled_by_mitsuba(mi, description, angle) for angle in angles]
    np.testing.assert_allclose(found, expected, rtol=5e-3)


def test_albedo_of_a_real_table_agrees_with_mitsubas():
    path = require_data("rgl", "satin_rosaline_rgb.bsdf")
    mi = require_mitsuba()
    angles = np.radians([0.0, 60.0, 85.0])
    found = albedo(nacre.load(path), angles).value
    description = {"type": "measured", "filename": str(path)}
    expected = [sampled_by_mitsuba(mi, description, angle) for angle in angles]
    np.testing.assert_allclose(found, expected, rtol=0.01)


def test_the_standard_error_is_about_the_error():
    exact = albedo(Lobe(500.0), math.radians(70.0), count=1 << 14).value[0]
    found = [albedo(Lobe(500.0), math.radians(70.0), count=128, seed=s) for s in range(12)]
    actual = math.sqrt(np.mean([(e.value[0] - exact) ** 2 for e in found]))
    stated = math.sqrt(np.mean([e.error[0] ** 2 for e in found]))
    assert 0.4 < actual / stated < 2.5


def test_reciprocity_of_a_known_case():
    # |x - y| x y over (x + y) x y / 2 on the unit square: 1/15 over 1/6.
    found = reciprocity_error(Tilted(0.5))
    assert float(found.value) == pytest.approx(0.4, rel=2e-3)
    assert abs(found.value - 0.4) < 5.0 * found.error + 1e-4


def test_reciprocal_materials_have_no_error():
    for brdf in (Constant(0.3), Brushed()):
        assert reciprocity_error(brdf, count=128).value < 1e-12


def test_only_pairs_known_both_ways_count():
    assert reciprocity_error(Partial(0.3), count=128).value < 1e-12
    one_way = Tilted(0.5).replaced(valid_components=lambda wi, wo: wi[2] > wo[2])
    assert math.isnan(reciprocity_error(one_way, count=128).value)


def test_anisotropy_of_a_known_case():
    found = anisotropy(Waves(0.5))
    assert float(found.value) == pytest.approx(0.6 * 2.0 / math.pi, rel=5e-3)


def test_anisotropy_sees_a_brushed_material_and_not_its_isotropic_copy():
    assert anisotropy(Brushed(), count=64).value > 0.1
    assert anisotropy(Turned(Brushed()), count=64).value < 1e-12
    assert anisotropy(Lobe(50.0), count=64).value < 1e-12


def test_the_known_share_is_over_solid_angle():
    assert known_fraction(Constant(0.3)) == 1.0
    assert known_fraction(Partial(0.3)) == pytest.approx(0.25, abs=2e-3)


def test_the_same_call_gives_the_same_figures():
    first, second = (albedo(Lobe(300.0), 0.5, count=64) for _ in range(2))
    np.testing.assert_array_equal(first.value, second.value)
    assert (albedo(Lobe(300.0), 0.5, count=64, seed=1).value != first.value).any()


@pytest.mark.parametrize(("white", "words"), [(1.0, "nowhere above 1"), (1.1, "exceeds 1: red")])
def test_facts_tell_whether_energy_is_gained(white, words):
    facts = physical_facts(Constant(white, 0.5, 0.2))
    assert facts["energy"].startswith(words)
    assert "green" not in facts["energy"]
    assert facts["largest albedo"] == pytest.approx([white, 0.5, 0.2])
    assert facts["unknown pairs"] == 0.0


def test_facts_of_a_material_of_which_nothing_is_known():
    nothing = Constant(0.0).replaced(valid_components=lambda wi, wo: wi[2] > 2.0)
    facts = physical_facts(nothing)
    assert facts["unknown pairs"] == 1.0
    assert facts["f cos range"] is None
    assert facts["reciprocity error"] is None
    json.dumps(facts, allow_nan=False)


def test_facts_of_an_anisotropic_material_name_the_azimuth():
    facts = physical_facts(Brushed())
    assert len(facts["largest albedo azimuth"]) == 3
    assert facts["anisotropy"] > 0.1
    assert set(UNITS) <= set(facts)
    json.dumps(facts, allow_nan=False)


def test_facts_of_what_overflows_stay_json():
    class Wild(Constant):
        def eval_components(self, wi, wo):
            return tuple(c / (0.0 * c) for c in super().eval_components(wi, wo))

    facts = physical_facts(Wild(0.5))
    json.dumps(facts, allow_nan=False)
    assert facts["energy"].startswith("exceeds 1: red")


def test_satin_gains_energy_at_grazing_views_only():
    facts = physical_facts(nacre.load(require_data("rgl", "satin_rosaline_rgb.bsdf")))
    assert facts["largest albedo at"] == [85.0] * 3
    assert facts["energy"].startswith("exceeds 1")
    assert max(facts["albedo at 0 degrees"]) < 0.8
    assert 0.0 < facts["unknown pairs"] < 0.01
