"""Mean squared errors as tables have them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np


def scaled(mse: float | None) -> str:
    """A mean squared error as tables show it: times ten thousand; a dash where there is none."""
    if mse is None or not math.isfinite(mse):
        return "–"
    return f"{1e4 * mse:.0f}" if mse >= 0.01 else f"{1e4 * mse:.3g}"


def geometric_mean(values: Sequence[float]) -> float:
    """Of numbers, none below zero; NaN of none."""
    with np.errstate(divide="ignore"):
        return float(np.exp(np.mean(np.log(values)))) if len(values) else math.nan
