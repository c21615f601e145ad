"""Fit of importance sampling lobes to a material."""

from __future__ import annotations

import math

from nacre.array import Floats
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.geometry import half_vector, split
from nacre.numerics.newton import minimize
from nacre.sampling.mixture import GgxMixture
from nacre.sampling.mixture_moment import MixtureMoment
from nacre.sampling.moment import Moment, second_moment

_COSINES = (0.1, 0.45, 1.0)
"""Of the views at which lobes are fitted: a sphere shows hardly any lower ones."""
_STARTS = (0.02, 0.1, 0.4)
"""Roughnesses."""
_APART = 0.6
"""How far from the one lobe's width a second one starts, either way."""
_WORTH = 1e-3
"""Least share of the cosine lobe's second moment that a mixture saves."""
_FIRST, _MORE = 10, 40
"""Steps of every start, and of the best."""


def fit_lobes(brdf: Brdf, seed: int = 0) -> Sampler:
    """Lobes that sample a reflectance with the least variance.

    For a set of views, directions drawn from a broad proposal estimate the second moment of
    f cos(theta_i) / p under the density p of a mixture (see :mod:`nacre.sampling.moment`). Newton
    steps lower it: from several roughnesses for a mixture of one lobe of GGX normals, then from
    that lobe in two parts. Lobes of an anisotropic material may stay with its axes.

    Parameters
    ----------
    brdf
        Any reflectance.
    seed
        Of the proposal's directions.

    Returns
    -------
    Sampler
        A :class:`GgxMixture` with four digits of each parameter; the cosine lobe of what is black
        or diffuse.
    """
    moment = second_moment(brdf, seed)
    if not moment.weights.any():
        return CosineSampler()
    fits = [_fit(moment, None)]
    if not brdf.isotropic:
        fits.append(_fit(moment, _main_axis(moment)))
    value, mixture = min(fits, key=lambda fit: fit[0])
    cosine = math.pi * float((moment.weights / moment.wi[..., 2]).sum())
    return mixture if value < (1.0 - _WORTH) * cosine else CosineSampler()


def _fit(moment: Moment, angle: float | None) -> tuple[float, GgxMixture]:
    """The least second moment found, and its mixture."""
    one, two = (MixtureMoment(moment, _COSINES, lobes, angle) for lobes in (1, 2))
    free = _best(one, [one.start((roughness,)) for roughness in _STARTS])[1]
    value, free = _best(two, [one.part(free, wider) for wider in (-_APART, _APART)])
    return value, two.mixture(free)


def _best(function: MixtureMoment, starts: list[Floats]) -> tuple[float, Floats]:
    """The least value found from some starts, the best of which goes on."""
    found = [minimize(function, start, _FIRST) for start in starts]
    return minimize(function, min(found, key=lambda pair: pair[0])[1], _MORE)


def _main_axis(moment: Moment) -> float:
    """Azimuth along which the half vectors of what is reflected spread most."""
    x, y, _ = half_vector(split(moment.wi), split(moment.wo))
    cosine, sine = (moment.weights * (x * x - y * y)).sum(), (moment.weights * x * y).sum()
    return float(f"{0.5 * math.atan2(2.0 * sine, cosine):.4g}")
