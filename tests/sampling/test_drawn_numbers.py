"""Samples whose random numbers are drawn, and albedos."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.brdf import Brdf
from nacre.metrics import albedo
from tests.analytic.materials import EXAMPLES
from tests.contracts.materials import MATERIALS


@pytest.fixture(params=["isotropic network", "anisotropic network"])
def brdf(request: pytest.FixtureRequest) -> Brdf:
    return MATERIALS[request.param]()


def test_numbers_are_drawn_from_a_seed_or_a_generator(brdf: Brdf) -> None:
    wo = np.float32([[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])
    wi, pdf = brdf.sample(wo, n=5, rng=7)
    assert (wi.shape, pdf.shape) == ((5, 2, 3), (5, 2))
    u = np.random.default_rng(7).random((5, 2, 3), np.float32)
    for again in (brdf.sample(wo, n=5, rng=np.random.default_rng(7)), brdf.sample(wo, u)):
        np.testing.assert_array_equal(again[0], wi)
        np.testing.assert_array_equal(again[1], pdf)
    assert brdf.sample(wo)[0].shape == (2, 3)
    assert brdf.sample([0, 0, 1])[1].shape == ()
    assert (brdf.sample(wo)[0] != brdf.sample(wo)[0]).any()
    np.testing.assert_allclose(pdf, brdf.pdf(wi, wo), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("given", [{"n": 3}, {"rng": 0}])
def test_numbers_are_given_or_drawn(brdf: Brdf, given: dict[str, int]) -> None:
    with pytest.raises(TypeError, match="takes the numbers u, or n and rng"):
        brdf.sample([0, 0, 1], [0.1, 0.2, 0.3], **given)


@pytest.mark.parametrize("name", ["lambert", "ggx", "ward"])
def test_albedos_agree_with_those_that_have_errors(name: str) -> None:
    material = EXAMPLES[name]
    theta = np.array([0.0, 0.7, 1.3])
    wo = np.stack([np.sin(theta), 0.0 * theta, np.cos(theta)], axis=-1)
    expected = albedo(material, theta)
    np.testing.assert_allclose(material.albedo(wo), expected.value, atol=5e-3)
    assert material.albedo().shape == (3,)


def test_the_albedo_of_a_white_surface_is_1() -> None:
    class White(Brdf):
        def eval_components(self, wi, wo):
            return (1.0 / math.pi + 0.0 * wi[2],) * 3

    np.testing.assert_allclose(White().albedo([[0, 0, 1], [0, 0.6, 0.8]]), 1.0, rtol=1e-5)
