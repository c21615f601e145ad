"""Projections: their factors are those of the nodes, and lie between them elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.array import Components
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join
from nacre.sampling.energy import views
from nacre.sampling.projection import Projection


class Bright(Brdf):
    """Reciprocal, gives back more light than it gets, and more of it about some azimuths."""

    isotropic = False

    def eval_components(self, wi: Components, wo: Components) -> Components:
        value = (1.0 + 0.5 * wi[0] * wo[0]) * (0.6 + 0.3 * (wi[1] + wo[1]))
        return value, 0.8 * value, 0.1 * value


@pytest.fixture(scope="module")
def projected() -> Projection:
    return Projection(Bright())


def scale(projected: Projection, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Products of factors by which f_r is smaller for pairs of directions, shape (n, 3)."""
    light, view = (join(from_spherical(theta[k], phi[k])) for k in range(2))
    return projected.eval(light, view) / Bright().eval(light, view)


def test_at_the_nodes_both_factors_count(projected: Projection) -> None:
    assert projected.factors is not None
    assert projected.factors.shape == (48, 16, 3)
    assert projected.factors[:, :, 2] == pytest.approx(1.0)
    assert 0.3 < projected.factors.min() < 0.9
    assert np.ptp(projected.factors, axis=1).max() > 0.05
    theta, phi = views(48, 16)
    row, column = np.random.default_rng(0).integers((1, 0), (40, 16), (2, 200, 2)).T.swapaxes(1, 2)
    found = scale(projected, theta[row, column], phi[row, column])
    expected = projected.factors[row[0], column[0]] * projected.factors[row[1], column[1]]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_between_the_nodes_factors_are_linear_in_azimuth_and_elevation(
    projected: Projection,
) -> None:
    factors = projected.factors
    assert factors is not None
    polar, azimuth = views(48, 16)
    row, column = 12, 15  # the next azimuth is that of the first column
    middle = np.log(np.cos(polar[row : row + 2, 0]) + 0.01).mean()
    theta, phi = math.acos(math.exp(middle) - 0.01), azimuth[0, column] + math.pi / 16
    low, high = factors[[row, row + 1]]
    mean = (low[15] + low[0] + high[15] + high[0]) / 4
    found = scale(projected, np.full((2, 1), theta), np.full((2, 1), phi))[0]
    np.testing.assert_allclose(found, mean**2, rtol=1e-6)
