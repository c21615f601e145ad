"""Choices by pictures against closed forms, and against chance."""

from __future__ import annotations

import numpy as np
import pytest

from nacre import analytic
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere
from nacre_lab.sparse import choices


def left(slopes, views, taken, noise):
    """Variance of what pictures show, by Bayesian linear regression on normal values."""
    rows = slopes[taken].reshape(-1, slopes.shape[-1])
    covariance = np.linalg.inv(np.eye(rows.shape[1]) + rows.T @ rows / noise**2)
    return np.trace(views @ covariance @ views.T)


@pytest.fixture(scope="module")
def linear():
    """30 readings in 3 channels and 9 pixels, all linear in 8 values, and 1,500 draws of them."""
    random = np.random.default_rng(1)
    slopes = random.normal(size=(30, 3, 8)) * random.uniform(0.1, 2.0, (30, 1, 1))
    slopes[:, :, 4:] *= random.uniform(0.0, 1.0, (30, 1, 1)) > 0.6
    views = random.normal(size=(9, 8)) * (1.0, 1.0, 0.1, 0.1, 3.0, 3.0, 0.1, 0.1)
    values = random.normal(size=(1500, 8))
    read = np.einsum("rck,dk->drc", slopes, values) + 0.5 * random.normal(size=(1500, 30, 3))
    return slopes, views, read, values @ views.T


def test_the_reading_that_leaves_least_is_chosen(linear):
    slopes, views, read, pictures = linear
    chosen = choices.regressed(read, pictures, 3)
    taken = []
    for index in chosen:
        best = min(left(slopes, views, [*taken, k], 0.5) for k in range(30) if k not in taken)
        taken.append(index)
        assert left(slopes, views, taken, 0.5) < 1.05 * best


def test_choices_beat_chance(linear):
    slopes, views, read, pictures = linear
    chosen = choices.regressed(read, pictures, 4)
    assert len(set(chosen)) == 4
    random = np.random.default_rng(2)
    chance = [left(slopes, views, random.permutation(30)[:4].tolist(), 0.5) for _ in range(200)]
    assert left(slopes, views, chosen, 0.5) < np.quantile(chance, 0.02)


def test_views_are_the_pixels_of_the_sphere():
    brdf = analytic.Ggx(diffuse=(0.1, 0.2, 0.3), specular=(0.9, 0.5, 0.2), roughness=0.3)
    lit = choices.sphere_views(size=8, directions=16)
    f_r = brdf.eval(lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3)).reshape(lit.wi.shape)
    image, mask = render_sphere(brdf, DirectionalLight(), 8)
    np.testing.assert_allclose(lit.radiance(f_r)[:, 1], image[mask], rtol=1e-4, atol=1e-5)
