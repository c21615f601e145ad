"""Networks that keep what is as plausible as they are."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.latent import pretrained_basis
from nacre.latent.directions import shared_directions
from nacre.latent.estimates import COUNT, FEW, estimate, facts, in_words, is_few, plausible
from nacre.measured import ScatteredBrdf
from nacre.metrics import albedo
from nacre.neural import Layer, NeuralBrdf
from tests.latent.made import random_basis

WI, WO = shared_directions(FEW + 1, 4)
NETWORK = NeuralBrdf([Layer(np.zeros((6, 3), np.float32), np.full(3, 0.2, np.float32))])


def scan(count: int, isotropic: bool = True) -> ScatteredBrdf:
    code = pretrained_basis().examples[3] + 0.2
    f_r = pretrained_basis().decode(code).eval(WI[:count], WO[:count])
    return ScatteredBrdf(WI[:count], WO[:count], f_r, "scan", isotropic=isotropic)


def test_few_are_up_to_a_number_of_isotropic_samples():
    found = [is_few(s) for s in (scan(FEW), scan(FEW + 1), scan(5, isotropic=False), NETWORK)]
    assert found == [True, False, False, False]


def test_a_network_keeps_plausible_materials_in_its_file(tmp_path):
    found = estimate(scan(20))
    nacre.save(found.kept_by(NETWORK), tmp_path / "x.safetensors")
    back = plausible(nacre.load(tmp_path / "x.safetensors"))
    assert len(back) == COUNT
    codes = np.stack([material.code for material in back])
    np.testing.assert_allclose(codes, found.codes, atol=1e-3)
    np.testing.assert_allclose(np.median(codes, axis=0), found.material.code, atol=1.0)
    assert plausible(NETWORK) == []
    assert facts(NETWORK) == {}
    assert in_words({}) == ""


def test_the_albedo_of_the_truth_is_told():
    known = facts(estimate(scan(40)).kept_by(NETWORK))
    truth = albedo(pretrained_basis().decode(pretrained_basis().examples[3] + 0.2), 0.0).value
    low, high = (np.array(known[f"plausible albedo {end}"]) for end in ("from", "to"))
    assert ((low < truth) & (truth < high)).all()
    assert (high < 1.6 * low).all()
    assert known["known from samples"] == 40
    assert 1.1 < known["f_r known within a factor"] < 1.6
    assert in_words(known).startswith("; from 40 samples: albedo 0.")


def test_more_samples_are_surer():
    factors = [estimate(scan(count)).facts()["f_r known within a factor"] for count in (3, 100)]
    assert factors[1] < 0.9 * factors[0]


def test_a_wrong_scale_is_told():
    bright = scan(40)
    bright = ScatteredBrdf(WI[:40], WO[:40], 2.0 * bright.samples.rgb, "bright")
    found = estimate(bright, free_scale=True)
    assert found.facts()["factor of the instrument"] == found.scale[0]
    assert found.kept_by(NETWORK).metadata["plausible"]["scale"] == found.scale[0]
    assert 1.05 < found.scale[0] < 2.0


def test_damage_and_other_bases_are_refused():
    kept = dict(estimate(scan(5)).kept_by(NETWORK).metadata["plausible"])
    with pytest.raises(FormatError, match="belong to another basis"):
        plausible(estimate(scan(5), random_basis()).kept_by(NETWORK), pretrained_basis())
    for bad in ({}, {"codes": "x"}, {"codes": 3}, {"codes": kept["codes"][:40]}, {"basis": None}):
        damaged = NETWORK.replaced(metadata={"plausible": {**kept, **bad} if bad else {}})
        with pytest.raises(FormatError, match="network: plausible materials"):
            plausible(damaged)
