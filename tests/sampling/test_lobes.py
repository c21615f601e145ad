"""Cosine and Blinn-Phong lobes: densities integrate to what samples find."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.brdf import CosineSampler
from nacre.sampling import BlinnPhongMixture
from nacre.sampling.lobes import expm1, log1p

from .reflectances import Shiny


def view(degrees: float) -> np.ndarray:
    return np.array([math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))])


@pytest.mark.parametrize(
    ("specular", "exponent"), [(-0.1, 1.0), (1.1, 1.0), (0.5, -1.0), (0.5, 1e9)]
)
def test_parameters_out_of_range_are_refused(specular, exponent):
    with pytest.raises(ValueError, match="must lie in"):
        BlinnPhongMixture(specular, exponent)


def test_the_default_sampler_is_the_cosine_lobe():
    wi, density = Shiny(1, 0, 1).sample(view(30), np.random.default_rng(0).random((1000, 3)))
    np.testing.assert_allclose(density, wi[:, 2] / math.pi, rtol=1e-6)
    assert isinstance(Shiny(1, 0, 1).sampler, CosineSampler)


@pytest.mark.parametrize(("specular", "exponent"), [(0.0, 0.0), (0.7, 60.0), (1.0, 3.0)])
def test_the_density_is_that_of_the_formula(specular, exponent):
    mixture = BlinnPhongMixture(specular, exponent)
    wo, wi = view(20.0), view(-55.0)
    half = (wi + wo) / np.linalg.norm(wi + wo)
    lobe = (exponent + 1.0) / (2.0 * math.pi) * half[2] ** exponent / (4.0 * half @ wo)
    expected = specular * lobe + (1.0 - specular) * wi[2] / math.pi
    assert mixture.pdf_components(tuple(wi), tuple(wo)) == pytest.approx(expected, rel=1e-6)


def test_the_density_is_0_at_the_horizon_and_below():
    mixture = BlinnPhongMixture(0.7, 1.0)
    for below in (np.array([1.0, 0.0, 0.0]), view(100.0), view(-100.0)):
        assert mixture.pdf_components(tuple(below), tuple(view(30.0))) == 0.0
        assert mixture.pdf_components(tuple(view(30.0)), tuple(below)) == 0.0
    assert mixture.pdf_components(tuple(view(89.9)), tuple(view(30.0))) > 0.01


def test_differences_of_numbers_near_1_keep_their_digits():
    x = np.array([0.0, 1e-7, 1e-3, 0.02, 0.0299, 0.0301, 0.5, 3.0])
    for values in (x, x.astype(np.float32)):
        np.testing.assert_allclose(expm1(values), np.expm1(values.astype(float)), rtol=2e-6)
        np.testing.assert_allclose(log1p(values), np.log1p(values.astype(float)), rtol=2e-6)


def test_a_description_makes_the_same_sampler():
    mixture = BlinnPhongMixture(0.25, 1234.5)
    again = BlinnPhongMixture.from_description({"specular": "0.25", "exponent": 1234.5})
    assert again == mixture
    assert str(mixture) == "25% Blinn-Phong of exponent 1234, else cosine"
