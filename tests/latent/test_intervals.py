"""Intervals of what is uncertain."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.latent.directions import shared_directions
from nacre.latent.intervals import interval, reflectance_interval
from nacre.latent.posterior import UNEXPLAINED
from nacre.numerics.direction_samples import DirectionSamples
from tests.latent.made import random_basis

WI, WO = shared_directions(400, 3)


def test_of_normal_values():
    """Against the quantiles of the normal distribution."""
    values = np.random.default_rng(2).normal(3.0, 2.0, (200_000, 2))
    low, high = interval(values, 0.9)
    np.testing.assert_allclose(low, 3.0 - 2.0 * 1.6449, atol=0.03)
    np.testing.assert_allclose(high, 3.0 + 2.0 * 1.6449, atol=0.03)


def test_one_material_leaves_what_no_code_explains():
    brdf = random_basis().decode(np.zeros(6))
    low, high = reflectance_interval([brdf], WI, WO)
    np.testing.assert_allclose(np.log(high / low), 2.0 * 1.64485 * UNEXPLAINED, rtol=1e-4)
    below = reflectance_interval([brdf], WI[:3] * (1, 1, -1), WO[:3])
    np.testing.assert_array_equal(below, 0.0)


@pytest.mark.slow
def test_intervals_hold_as_often_as_they_say():
    """Materials like those of the training, but for what no code explains; eight samples each."""
    made = random_basis()
    random = np.random.default_rng(5)
    inside = []
    for _ in range(40):
        code = made.examples[random.integers(len(made.examples))] + random.normal(0.0, 0.5, 6)
        f_r = made.decode(code).eval(WI, WO) * np.exp(random.normal(0.0, UNEXPLAINED, (len(WI), 1)))
        plausible = made.posterior(DirectionSamples(WI[:8], WO[:8], f_r[:8])).draw(60)
        low, high = reflectance_interval([made.decode(c) for c in plausible], WI[8:], WO[8:])
        inside.append(np.mean((low <= f_r[8:]) & (f_r[8:] <= high)))
    assert 0.85 < np.mean(inside) < 0.97
