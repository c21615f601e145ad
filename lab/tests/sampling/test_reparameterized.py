"""The learned sampler: its Jacobian, what training makes of it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.errors import NacreError
from nacre.geometry import join
from nacre_lab.sampling.reparameterized import INPUTS, Reparameterized

torch = pytest.importorskip("torch", reason="needs the extra 'btf'")

SIZES = INPUTS, 16, 16, 3
VIEW = np.array([0.48, 0.64, 0.6])


def layers(seed=0):
    rng = np.random.default_rng(seed)
    return [
        (rng.normal(0.0, 0.4, (a, b)).astype(np.float32), rng.normal(0, 0.3, b).astype(np.float32))
        for a, b in itertools.pairwise(SIZES)
    ]


def test_the_density_is_that_of_a_change_of_variables():
    """Areas of small quadrilaterals of directions against those of their random numbers."""
    sampler, step = Reparameterized(layers()), 1e-7
    u = np.random.default_rng(1).random((3, 200)) * 0.9 + 0.05
    wo = tuple(VIEW)

    def at(du, dv):
        wi, density = sampler.sample_components(wo, (u[0], u[1] + du, u[2] + dv))
        return join(wi), density

    (middle, density), (right, _), (up, _) = at(0.0, 0.0), at(step, 0.0), at(0.0, step)
    solid_angle = np.linalg.norm(np.cross(right - middle, up - middle), axis=-1) / step**2
    np.testing.assert_allclose(density * solid_angle, 1.0, rtol=2e-3)


def test_directions_turn_with_the_view():
    sampler, u = Reparameterized(layers()), np.random.default_rng(2).random((3, 50))
    (x, y, z), density = sampler.sample_components((0.8, 0.0, 0.6), u)
    (a, b, c), same = sampler.sample_components(tuple(VIEW), u)
    np.testing.assert_allclose(density, same)
    np.testing.assert_allclose(np.stack([0.6 * x - 0.8 * y, 0.8 * x + 0.6 * y, z]), [a, b, c])


def test_float32_gives_the_same_samples():
    brdf = Ggx(diffuse=(0.1,) * 3, specular=(0.5,) * 3, roughness=0.3)
    brdf = brdf.replaced(sampler=Reparameterized(layers()))
    u = np.random.default_rng(3).random((100, 3)).astype(np.float32)
    for found, expected in zip(
        brdf.sample(VIEW.astype(np.float32), u), brdf.sample(VIEW, u.astype(float)), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=2e-3, atol=2e-4)


def test_other_directions_have_no_known_density():
    with pytest.raises(NacreError, match="where it samples only"):
        Reparameterized(layers()).pdf_components((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))


@pytest.mark.slow
def test_training_covers_the_hemisphere():
    from nacre_lab.sampling.training import train

    brdf = Ggx(diffuse=(0.05,) * 3, specular=(0.5,) * 3, roughness=0.3)
    u = np.random.default_rng(4).random((20_000, 3))
    view = np.array([0.5, 0.0, np.sqrt(0.75)])

    def weights(sampler):
        wi, density = brdf.replaced(sampler=sampler).sample(view, u)
        cosine = np.divide(wi[:, 2], density, out=np.zeros_like(density), where=density > 0.0)
        return brdf.eval(wi, view)[:, 0] * cosine

    truth = weights(brdf.sampler).mean()
    little, more = (weights(train(brdf, steps=steps, views=16)) / truth for steps in (5, 250))
    assert little.mean() < 0.5  # a map that leaves a part out misses its light
    assert abs(more.mean() - 1.0) < 0.04
    assert np.quantile(np.abs(np.log(np.maximum(more, 1e-9))), 0.9) < 0.8
