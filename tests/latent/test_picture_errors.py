"""Errors that codes are found by."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.array import Array, Components
from nacre.latent.picture_errors import PictureErrors
from nacre.sampling.lit_views import lit_views

MATTE = {"diffuse": (0.5,) * 3, "specular": (0.0,) * 3, "roughness": 0.5}
GREY = Ggx(**MATTE)


class Eastern(Ggx):
    """Known where the light comes from one side."""

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return wi[0] > 0.0


def test_a_material_is_no_distance_from_itself():
    for truth in (GREY, Eastern(**MATTE)):
        errors = PictureErrors(truth)
        assert (errors.wi[:, 0] > 0.0).all() == isinstance(truth, Eastern)
        np.testing.assert_allclose(errors.errors(truth.eval(errors.wi, errors.wo)), 0.0, atol=1e-6)


def test_both_kinds_are_as_they_are_defined():
    errors, lit = PictureErrors(GREY, 3), lit_views(3)
    truth = GREY.eval(errors.wi, errors.wo)[:, 0].astype(float)
    found = errors.errors(0.5 * np.repeat(truth[:, None], 3, axis=1))
    count = len(truth) - lit.wi.size // 3
    scaled = 30 * truth[:count] * errors.wi[:count, 2]
    single = np.log1p(0.5 * scaled) - np.log1p(scaled)
    np.testing.assert_allclose(found[: 3 * count : 3], single, rtol=1e-4, atol=1e-6)
    radiance = (lit.weights * truth[count:].reshape(len(lit.wi), 1, -1)).sum(axis=2)
    seen = (0.5 * radiance + 1e-4) ** (1 / 2.2) - (radiance + 1e-4) ** (1 / 2.2)
    rest = found[3 * count :].reshape(*radiance.shape, 3)
    share = rest[..., 0] / seen
    np.testing.assert_allclose(share, share[0, 0], rtol=1e-4)
    # As a whole, ten times the weight.
    assert share[0, 0] * rest.size == pytest.approx(10 * 3 * count)


@pytest.mark.parametrize("truth", [GREY, Eastern(**MATTE)])
def test_slopes_are_those_of_finite_differences(truth):
    errors = PictureErrors(truth)
    random = np.random.default_rng(1)
    f_r = random.uniform(-0.2, 1.0, errors.wi.shape)
    f_r[np.abs(f_r) < 1e-3] = 0.1  # no derivative at 0
    rates = random.normal(size=(4, *f_r.shape))
    numeric = [
        (errors.errors(f_r + 1e-6 * r) - errors.errors(f_r - 1e-6 * r)) / 2e-6 for r in rates
    ]
    np.testing.assert_allclose(errors.slopes(f_r, rates), numeric, rtol=1e-3, atol=1e-4)
