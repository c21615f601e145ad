"""Least absolute residuals, or least squares, by Levenberg-Marquardt steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nacre.array import Doubles, Floats

_SOFTENING = 0.05  # residuals below this share of the mean count as squares
_LONGEST = 2.0  # change of a parameter in one step
_ENOUGH = 1e-5  # relative gain of a step below which it is the last
_HOPELESS = 1e8  # damping at which no step helps any more


def minimize(
    residuals: Callable[[Doubles], Floats],
    jacobian: Callable[[Doubles, Any], Floats],
    start: Doubles,
    iterations: int,
    limit: float = math.inf,
    squares: bool = False,
) -> tuple[Doubles, float]:
    """Parameters (p,) near a start that minimize the mean absolute residual, or the mean square,
    and that mean.

    Each step solves least squares, damped after Levenberg and Marquardt. For absolute values a
    residual r weighs 1 / sqrt(r^2 + e^2), so that the weighted squares bound them from above
    (iteratively reweighted least squares).

    Residuals are float32 or float64 of any shape; the Jacobian, of shape (p, *residuals), is called
    with parameters and the residuals there. Parameters stay within `limit` of 0. The mean is
    infinite where it is not finite at the start.
    """

    def mean(values: Floats) -> float:
        return float((values * values if squares else np.abs(values)).mean())

    free, damping = start, 1e-2
    current = residuals(free)
    loss = mean(current)
    if not math.isfinite(loss):
        return free, math.inf
    for _ in range(iterations):
        rows = weighted = jacobian(free, current).reshape(len(free), -1)
        if not squares:
            weights = 1.0 / np.sqrt(current**2 + (_SOFTENING * loss + 1e-12) ** 2).reshape(-1)
            weighted = rows * weights.astype(rows.dtype)
        products = weighted @ rows.T, weighted @ current.reshape(-1)
        normal, slope = (product.astype(np.float64) for product in products)
        scale = np.diag(normal) + 1e-12 * np.trace(normal) + 1e-300
        before = loss
        while damping < _HOPELESS:
            step = np.linalg.solve(normal + np.diag(damping * scale), -slope)
            moved = np.clip(free + np.clip(step, -_LONGEST, _LONGEST), -limit, limit)
            trial = residuals(moved)
            tried = mean(trial)
            if tried < loss:
                free, current, loss, damping = moved, trial, tried, damping * 0.2
                break
            damping *= 5.0
        if before - loss <= _ENOUGH * before:
            break
    return free, loss
