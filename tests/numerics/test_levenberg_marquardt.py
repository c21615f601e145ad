"""Least absolute residuals: against a median, and parameters that lie far out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.numerics.levenberg_marquardt import minimize


@pytest.mark.parametrize("middle", [0.0, 90.0])
def test_the_median_is_found(middle):
    values = middle + np.array([-3.0, -1.0, 0.0, 0.5, 40.0])
    found, loss = minimize(
        lambda free: free[0] - values, lambda free, _: np.ones((1, 5)), np.array([100.0]), 100
    )
    assert found[0] == pytest.approx(np.median(values), abs=0.1)
    assert loss == pytest.approx(np.abs(values - np.median(values)).mean(), rel=1e-2)


def test_parameters_stay_within_the_limit():
    found, _ = minimize(lambda x: x - 9.0, lambda x, _: np.ones((1, 1)), np.zeros(1), 50, 5.0)
    assert found[0] == 5.0


def test_a_start_that_is_not_finite_is_given_back():
    start = np.array([1.0])
    found, loss = minimize(lambda x: x * math.inf, lambda x, _: np.ones((1, 1)), start, 5)
    assert found is start
    assert loss == math.inf


def test_least_squares_of_several_parameters_are_those_of_linear_algebra():
    random = np.random.default_rng(5)
    rows, values = random.normal(size=(20, 3)), random.normal(size=20)
    found, loss = minimize(
        lambda x: rows @ x - values, lambda x, _: rows.T, np.zeros(3), 100, squares=True
    )
    expected = np.linalg.lstsq(rows, values)[0]
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert loss == pytest.approx(np.mean((rows @ expected - values) ** 2), rel=1e-4)


def test_steps_are_of_2_at_most_and_end_when_nothing_is_gained():
    asked = []

    def residuals(x):
        asked.append(x.copy())
        return np.array([x[0] - 7.0, 0.5])

    def jacobian(x, _):
        return np.array([[1.0, 0.0]])

    found, loss = minimize(residuals, jacobian, np.zeros(1), 1000, squares=True)
    assert found[0] == pytest.approx(7.0, abs=1e-3)
    assert loss == pytest.approx(0.125, rel=1e-4)
    assert np.abs(np.diff(asked, axis=0)).max() == pytest.approx(2.0)
    assert len(asked) < 15
