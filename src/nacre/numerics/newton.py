"""Damped Newton steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from nacre.array import Floats

Terms: TypeAlias = tuple[float, Floats, Floats]
"""Value, gradient (p,) and Hessian (p, p) of a function."""

_LONGEST = 2.0  # change of a parameter in one step
_HOPELESS = 1e8  # damping at which no step helps any more


def minimize(
    function: Callable[[Floats], Terms], start: Floats, iterations: int, enough: float = 1e-5
) -> tuple[float, Floats]:
    """Least value of a function of parameters (p,) near where it starts, and its parameters.

    Steps are damped after Levenberg and Marquardt, so an approximate Hessian will do, as long as it
    is positive semidefinite. A gain below `enough` ends them.
    """
    best = start
    value, gradient, hessian = function(best)
    damping = 1e-3
    for _ in range(iterations):
        curvature = np.maximum(np.diag(hessian), 1e-9)
        step = np.linalg.solve(hessian + np.diag(damping * curvature + 1e-9), -gradient)
        step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), _LONGEST))
        trial, gain = function(best + step), 0.0
        if trial[0] < value:
            gain = value - trial[0]
            best = best + step
            value, gradient, hessian = trial
            damping = max(0.2 * damping, 1e-8)
            if gain < enough:
                break
        elif (damping := 5.0 * damping) > _HOPELESS:
            break
    return value, best
