"""Microfacets that were put in come out of the power iteration again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import erf

from nacre.analytic import MODELS, AnisotropicGgx, Ggx, fit
from nacre.analytic.factor import even_angles, half_angles
from nacre.analytic.fresnel import schlick
from nacre.brdf import Brdf
from nacre.geometry import half_vector
from nacre.measured import ScatteredBrdf
from tests.measured.support import hemisphere

MODEL = MODELS["tabulated-microfacets"]
COLOUR = (0.9, 0.5, 0.2)


class Beckmann(Brdf):
    """Facets of a perfect mirror with Beckmann's distribution (Walter et al. 2007, Heitz 2014)."""

    def __init__(self, alpha: float) -> None:
        self.alpha = alpha

    def masked(self, w):
        """Smith's Lambda."""
        x = w[2] / np.maximum(self.alpha * np.hypot(w[0], w[1]), 1e-9)
        return 0.5 * (erf(x) - 1.0 + np.exp(-x * x) / (x * math.sqrt(math.pi)))

    def eval_components(self, wi, wo):
        h = half_vector(wi, wo)
        square = np.maximum(h[2] ** 2, 1e-6)
        tan2 = (h[0] ** 2 + h[1] ** 2) / square
        density = np.exp(-tan2 / self.alpha**2) / (math.pi * self.alpha**2 * square**2)
        f = density / (4.0 * wi[2] * wo[2] * (1.0 + self.masked(wi) + self.masked(wo)))
        return f, f, f


def extract(brdf):
    return fit(brdf, MODEL, samples=1000)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.3, 1.0])
def test_the_roughness_of_ggx_comes_back(alpha):
    found = extract(Ggx(diffuse=(0, 0, 0), specular=COLOUR, roughness=alpha))
    assert found.metadata["fit"]["ggx roughness"] == pytest.approx(alpha, rel=2e-3)


@pytest.mark.parametrize("alpha", [0.02, 0.2, 0.6])
def test_the_roughness_of_beckmann_comes_back(alpha):
    found = extract(Beckmann(alpha))
    assert found.metadata["fit"]["beckmann roughness"] == pytest.approx(alpha, rel=2e-3)


def test_the_distribution_and_the_fresnel_term_of_ggx_come_back():
    found = extract(Ggx(diffuse=(0, 0, 0), specular=COLOUR, roughness=0.25))
    theta = half_angles()[:-1]
    slopes = (np.sin(theta) / 0.25) ** 2 + np.cos(theta) ** 2
    expected = 1.0 / (math.pi * 0.25**2 * slopes**2)
    np.testing.assert_allclose(found.values["distribution"][0][:-1], expected, rtol=5e-3)
    known = even_angles() < math.radians(85.0)
    expected = np.stack(schlick(np.cos(even_angles()), COLOUR))
    np.testing.assert_allclose(
        np.array(found.values["fresnel"])[:, known], expected[:, known], rtol=0.01
    )


@pytest.mark.parametrize(("alpha", "error"), [(0.05, 0.07), (0.1, 0.03), (0.4, 0.01)])
def test_a_material_of_microfacets_only_is_its_own_fit(alpha, error):
    """What is left is linear interpolation between 90 nodes."""
    truth = Ggx(diffuse=(0, 0, 0), specular=COLOUR, roughness=alpha)
    wi, wo = (hemisphere(np.random.default_rng(k), 5000) for k in range(2))
    difference = np.abs(extract(truth).eval(wi, wo) / truth.eval(wi, wo) - 1.0)
    assert np.quantile(difference, 0.99) < error


def test_an_anisotropic_material_is_averaged_over_its_azimuths():
    truth = AnisotropicGgx(
        diffuse=(0, 0, 0), specular=COLOUR, roughness_x=0.1, roughness_y=0.3, angle=0.4
    )
    assert 0.1 < extract(truth).metadata["fit"]["ggx roughness"] < 0.3


def test_black_and_scans_can_be_fitted():
    wi, wo = (hemisphere(np.random.default_rng(k), 400) for k in range(2))
    assert not extract(ScatteredBrdf(wi, wo, np.zeros((400, 3)))).eval(wi, wo).any()
    truth = Ggx(diffuse=(0, 0, 0), specular=COLOUR, roughness=0.6)
    found = extract(ScatteredBrdf(wi, wo, truth.eval(wi, wo)))
    assert 0.4 < found.metadata["fit"]["ggx roughness"] < 0.8
