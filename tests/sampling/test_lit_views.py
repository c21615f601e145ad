"""Views under lights of all sizes, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.sampling.lit_views import lit_views

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
