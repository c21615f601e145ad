"""Damped Newton steps: against minima that are known."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.numerics.newton import Terms, minimize

MATRIX = np.array([[3.0, 1.0], [1.0, 2.0]])
MINIMUM = np.array([0.7, -1.1])


class Bowl:
    """4 more than half a quadratic form; notes where it is asked."""

    def __init__(self, hessian: float = 1.0) -> None:
        self.asked: list[np.ndarray] = []
        self.hessian = hessian

    def __call__(self, x: np.ndarray) -> Terms:
        self.asked.append(x)
        away = x - MINIMUM
        return 4.0 + 0.5 * away @ MATRIX @ away, MATRIX @ away, self.hessian * MATRIX


def test_a_quadratic_form_takes_few_steps() -> None:
    bowl = Bowl()
    value, found = minimize(bowl, np.zeros(2), 50, 1e-12)
    np.testing.assert_allclose(found, MINIMUM, atol=1e-6)
    assert value == pytest.approx(4.0)
    assert len(bowl.asked) < 8


def test_no_parameter_moves_by_more_than_2_in_a_step() -> None:
    bowl = Bowl()
    _, found = minimize(bowl, np.array([30.0, -20.0]), 60)
    np.testing.assert_allclose(found, MINIMUM, atol=1e-3)
    steps = np.abs(np.diff(bowl.asked, axis=0)).max(axis=1)
    assert steps.max() == pytest.approx(2.0)
    assert steps[0] == pytest.approx(2.0)


@pytest.mark.parametrize("hessian", [0.3, 1e-4])
def test_steps_that_go_too_far_are_damped(hessian: float) -> None:
    bowl = Bowl(hessian)
    value, found = minimize(bowl, np.zeros(2), 200, 1e-9)
    np.testing.assert_allclose(found, MINIMUM, atol=1e-3)
    assert value == pytest.approx(4.0, abs=1e-6)


def test_a_gain_below_enough_is_the_last() -> None:
    few, many = Bowl(5.0), Bowl(5.0)
    minimize(few, np.zeros(2), 100, enough=0.1)
    minimize(many, np.zeros(2), 100, enough=1e-9)
    assert 2 <= len(few.asked) < len(many.asked) < 100


def test_where_no_step_helps_the_start_is_given_back() -> None:
    asked = []

    def uphill(x: np.ndarray) -> Terms:
        asked.append(x)
        return 1.0 + abs(x[0]), np.ones(1), np.eye(1)

    start = np.zeros(1)
    value, found = minimize(uphill, start, 1000)
    assert found is start
    assert value == 1.0
    assert len(asked) < 30  # damping grows fivefold, from 1e-3 to 1e8


def test_no_more_steps_are_taken_than_may_be() -> None:
    bowl = Bowl()
    minimize(bowl, np.array([30.0, -20.0]), 3)
    assert len(bowl.asked) == 4
