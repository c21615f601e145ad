"""Mitsuba's chi-square test of samplers that tables or networks give."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import pytest

import nacre.render
from nacre.brdf import Brdf
from nacre.measured.microfacet_warp import microfacet_sampler
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from tests.latent.made import predictor, random_basis
from tests.reflectances import Glossy

from .chi_square import chi_square

DEGREES = (0.0, 30.0, 60.0, 80.0, 85.0)
MATERIALS = {"broad": Glossy(0.2, 0.1, 0.4), "sharp": Glossy(0.1, 0.5, 0.03)}
CODE = (0.9, -1.3, 0.4, 0.2, 1.1, -0.7)


def check(mi: Any, brdf: Brdf, degrees: float, tests: int) -> None:
    test = chi_square(mi, nacre.render.bsdf(brdf), degrees)
    assert test.run(test_count=tests * len(DEGREES), quiet=True), test.messages


# The test's integral does not resolve a sharp lobe at the pole.
@pytest.mark.parametrize(
    ("name", "degrees"), [("broad", 0.0), *itertools.product(MATERIALS, DEGREES[1:])]
)
def test01_microfacets_by_power_iteration(rgb: Any, name: str, degrees: float) -> None:
    brdf = MATERIALS[name]
    sampled = brdf.replaced(sampler=microfacet_sampler(brdf))
    check(rgb, sampled, degrees, len(MATERIALS))


@pytest.mark.parametrize("degrees", DEGREES)
@pytest.mark.parametrize("family", PARAMETRIZATIONS)
def test02_predicted_lobes_of_a_code(rgb: Any, family: str, degrees: float) -> None:
    predictors = {name: predictor(name, scale=0.3) for name in PARAMETRIZATIONS}
    decoded = replace(random_basis(), predictors=predictors).decode(CODE)
    decoded = decoded.replaced(sampler=predictors[family](CODE))
    check(rgb, decoded, degrees, len(PARAMETRIZATIONS))
