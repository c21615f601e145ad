"""Views under lights of all sizes, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.latent import encoding
from nacre.latent.lit_views import lit_views
from tests.latent.made import random_basis

LIT = lit_views(0)


def test_the_sky_shows_the_albedo():
    white = np.full(LIT.wi.shape, 1.0 / np.pi)
    albedos = LIT.radiance(white)[:, 0]
    assert albedos.mean() == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(albedos, 1.0, atol=0.2)


def test_lamps_are_as_bright_as_the_sky():
    """Lamps all over the sky add up to it: where one is above, the mean cosine is one half."""
    white = np.full(LIT.wi.shape, 1.0 / np.pi)
    seen = [lit_views(seed).radiance(white)[:, 1::2] for seed in range(20)]
    assert np.mean(seen) == pytest.approx(0.5, abs=0.03)


def test_seeds_are_kept():
    again, other = lit_views(0), lit_views(1)
    for name in ("wi", "wo", "weights"):
        np.testing.assert_array_equal(getattr(LIT, name), getattr(again, name))
    assert not np.array_equal(LIT.weights, other.weights)
    np.testing.assert_allclose(LIT.wo, LIT.wo[:, :1] + 0.0 * LIT.wo, atol=1e-6)


@pytest.mark.parametrize("term", ["single", "seen"])
def test_derivatives_are_those_of_finite_differences(term):
    made = random_basis()
    truth = made.decode(np.full(6, 0.3))
    if term == "seen":
        errors = encoding._Seen(made, LIT, truth)
    else:
        wi, wo = LIT.wi.reshape(-1, 3), LIT.wo.reshape(-1, 3)
        errors = encoding._Single(made, wi, wo, truth.eval(wi, wo))
    code = np.array([0.4, -0.2, 0.7, 0.1, -0.5, 0.3])
    steps = 1e-5 * np.eye(6)
    numeric = [(errors.residuals(code + s) - errors.residuals(code - s)) / 2e-5 for s in steps]
    np.testing.assert_allclose(errors.jacobian(code), numeric, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(errors.residuals(np.full(6, 0.3)), 0.0, atol=1e-5)
