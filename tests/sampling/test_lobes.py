"""Cosine and Blinn-Phong lobes: densities integrate to what samples find."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.brdf import CosineSampler
from nacre.sampling import BlinnPhongMixture

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
