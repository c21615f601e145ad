"""Cosine and Blinn-Phong lobes: densities integrate to what samples find."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.brdf import CosineSampler
from nacre.geometry import join, split
from nacre.sampling import BlinnPhongMixture, UniformSampler

from .reflectances import Shiny


def view(degrees: float) -> np.ndarray:
    return np.array([math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))])


@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
@pytest.mark.parametrize("exponent", [0.0, 5.0, 200.0, 5000.0])
@pytest.mark.parametrize("specular", [0.0, 0.5, 1.0])
def test_the_density_integrates_to_the_share_of_samples_above_the_horizon(
    degrees, exponent, specular
):
    mixture = BlinnPhongMixture(specular, exponent)
    wo = np.broadcast_to(view(degrees), (200_000, 3))
    # Importance sampling of the density by a broader mixture is an independent integral.
    broad = BlinnPhongMixture(0.5 * specular, 0.5 * exponent)
    u = np.random.default_rng(0).random((200_000, 3))
    wi, density = broad.sample_components(split(wo), split(u))
    above = (wi[2] > 0) & (density > 0)
    safe = np.where(above, density, 1.0)
    integral = np.where(above, mixture.pdf_components(wi, split(wo)) / safe, 0.0)
    drawn, own = mixture.sample_components(split(wo), split(u))
    share = ((drawn[2] > 0) & (own > 0)).mean()
    error = 5 * (integral.std() + 1) / math.sqrt(len(u))
    assert integral.mean() == pytest.approx(share, abs=error)
    np.testing.assert_allclose(np.linalg.norm(join(drawn), axis=-1), 1.0, atol=1e-9)


@pytest.mark.parametrize("power", [0, 1, 2, 3])
def test_uniform_samples_have_the_moments_of_the_hemisphere(power):
    u = np.random.default_rng(1).random((100_000, 3))
    wi, density = UniformSampler().sample_components(split(view(40.0)), split(u))
    np.testing.assert_allclose(np.linalg.norm(join(wi), axis=-1), 1.0, atol=1e-9)
    np.testing.assert_allclose(density, 0.5 / math.pi)
    # The integral of cos^k over the hemisphere is 2 pi / (k + 1), and of x and y zero.
    mean = (wi[2] ** power / density).mean()
    assert mean == pytest.approx(2.0 * math.pi / (power + 1), rel=0.01)
    assert abs((wi[0] / density).mean()) < 0.05
    assert abs((wi[1] / density).mean()) < 0.05


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
