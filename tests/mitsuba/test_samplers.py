"""Mitsuba's chi-square test of samplers that tables or networks give."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import nacre.mitsuba
from nacre.brdf import Brdf
from nacre.measured.microfacet_warp import microfacet_sampler
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from tests.latent.made import predictor, random_basis
from tests.reflectances import Glossy

from .chi_square import chi_square

MATERIALS = {"broad": Glossy(0.2, 0.1, 0.4), "sharp": Glossy(0.1, 0.5, 0.03)}
CODE = (0.9, -1.3, 0.4, 0.2, 1.1, -0.7)


def check(mi: Any, brdf: Brdf, degrees: float) -> None:
    test = chi_square(mi, nacre.mitsuba.bsdf(brdf), degrees)
    assert test.run(test_count=6, quiet=True), test.messages


@pytest.mark.parametrize(("name", "degrees"), [("broad", 30.0), ("broad", 80.0), ("sharp", 60.0)])
def test01_microfacets_by_power_iteration(rgb: Any, name: str, degrees: float) -> None:
    brdf = MATERIALS[name]
    check(rgb, brdf.replaced(sampler=microfacet_sampler(brdf)), degrees)


@pytest.mark.parametrize("family", PARAMETRIZATIONS)
def test02_predicted_lobes_of_a_code(rgb: Any, family: str) -> None:
    predictors = {name: predictor(name, scale=0.3) for name in PARAMETRIZATIONS}
    decoded = replace(random_basis(), predictors=predictors).decode(CODE)
    check(rgb, decoded.replaced(sampler=predictors[family](CODE)), 60.0)
