"""Lobe mixtures: densities integrate to what samples find; fits reduce variance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.brdf import Brdf, CosineSampler
from nacre.geometry import half_vector, join, split
from nacre.sampling import BlinnPhongMixture, fit_lobes


class Shiny(Brdf):
    """Diffuse plus a Blinn-Phong highlight, of known parameters."""

    def __init__(self, diffuse: float, specular: float, exponent: float) -> None:
        self.diffuse, self.specular, self.exponent = diffuse, specular, exponent

    def eval_components(self, wi, wo):
        lobe = np.maximum(half_vector(wi, wo)[2], 1e-9) ** self.exponent
        value = self.diffuse / math.pi + self.specular * (self.exponent + 2) / 8 * lobe / math.pi
        return value, value, value


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


@pytest.mark.parametrize(
    ("specular", "exponent"), [(-0.1, 1.0), (1.1, 1.0), (0.5, -1.0), (0.5, 1e9)]
)
def test_parameters_out_of_range_are_refused(specular, exponent):
    with pytest.raises(ValueError, match="must lie in"):
        BlinnPhongMixture(specular, exponent)


def second_moment(brdf: Brdf, degrees: float) -> float:
    wo = np.broadcast_to(view(degrees), (100_000, 3))
    wi, density = brdf.sample(wo, np.random.default_rng(1).random((100_000, 3)))
    value = brdf.eval(wi, wo)[:, 0] * wi[:, 2]
    weights = np.where(density > 0, value / np.where(density > 0, density, 1.0), 0.0)
    return float((weights**2).mean() / weights.mean() ** 2)


@pytest.mark.parametrize("exponent", [20.0, 500.0, 20000.0])
def test_fitted_lobes_beat_the_cosine_lobe_and_find_the_highlight(exponent):
    brdf = Shiny(0.3, 0.3, exponent)
    cosine = [second_moment(brdf, degrees) for degrees in (10, 45, 70)]
    brdf.sampler = fit_lobes(brdf)
    fitted = [second_moment(brdf, degrees) for degrees in (10, 45, 70)]
    assert np.mean(fitted) < np.mean(cosine)
    assert max(fitted) < 3
    assert 0.3 * exponent < brdf.sampler.exponent < 3 * exponent


def test_black_and_matt_get_the_cosine_lobe():
    assert fit_lobes(Shiny(0.0, 0.0, 1.0)).specular == 0.0
    matt = Shiny(0.5, 0.0, 1.0)
    matt.sampler = fit_lobes(matt)
    assert second_moment(matt, 45) < 1.05


def test_the_same_seed_fits_the_same_lobes():
    assert fit_lobes(Shiny(0.2, 0.2, 50.0), 3) == fit_lobes(Shiny(0.2, 0.2, 50.0), 3)


def test_the_default_sampler_is_the_cosine_lobe():
    wi, density = Shiny(1, 0, 1).sample(view(30), np.random.default_rng(0).random((1000, 3)))
    np.testing.assert_allclose(density, wi[:, 2] / math.pi, rtol=1e-6)
    assert isinstance(Shiny(1, 0, 1).sampler, CosineSampler)
