"""Intervals for what is known about a material only through others that are as plausible."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.latent.posterior import UNEXPLAINED

FRACTION = 0.9
"""How often the truth should lie inside an interval."""

DEVIATION = 0.6827
"""How often the truth lies within a standard deviation."""

_MANY = 40  # values from which on their own quantiles are taken
_SMALLEST = 1e-9  # f_r in 1/sr below which it counts as this: black has no logarithm


def interval(values: npt.ArrayLike, fraction: float = FRACTION) -> tuple[Doubles, Doubles]:
    """Ends (...) between which a fraction of values (m, ...) lies, with as many below as above.

    Of a few values, that is Student's interval for a further one.
    """
    tail = 0.5 * (1.0 - fraction)
    given = np.asarray(values, np.float64)
    if 1 < len(given) < _MANY:
        from scipy.special import stdtrit

        deviation = given.std(axis=0, ddof=1) * math.sqrt(1.0 + 1.0 / len(given))
        half = -float(stdtrit(len(given) - 1, tail)) * deviation
        return given.mean(axis=0) - half, given.mean(axis=0) + half
    low, high = np.quantile(given, (tail, 1.0 - tail), axis=0)
    return low, high


def reflectance_interval(
    plausible: Sequence[Brdf],
    wi: npt.ArrayLike,
    wo: npt.ArrayLike,
    fraction: float = FRACTION,
    unexplained: float = UNEXPLAINED,
) -> tuple[Doubles, Doubles]:
    """Ends of f_r in 1/sr at pairs of directions, linear RGB, shapes (..., 3), between which the
    truth should lie with a frequency of `fraction`.

    Where the `plausible` materials, one or more, leave ln f_r uncertain, what none of them explains
    adds to it, with the standard deviation `unexplained`. In integrals over directions, as an
    albedo or a picture, that averages out: :func:`interval` is enough there. Directions, shapes
    (..., 3), broadcast; the ends are 0 where one is at or below the horizon.
    """
    from scipy.special import ndtri

    values = np.stack([brdf.eval(wi, wo) for brdf in plausible]).astype(np.float64)
    logs = np.log(np.maximum(values, _SMALLEST))
    low, high = interval(logs, fraction)
    middle = np.median(logs, axis=0)
    own = unexplained * float(ndtri(0.5 + 0.5 * fraction))
    ends = middle - np.hypot(middle - low, own), middle + np.hypot(high - middle, own)
    visible = values.max(axis=0) > 0.0
    lower, upper = (np.where(visible, np.exp(end), 0.0) for end in ends)
    return lower, upper
