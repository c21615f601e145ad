"""Fits of importance sampling lobes to a material, and materials that are sampled by them."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.geometry import half_vector, split
from nacre.numerics.newton import minimize
from nacre.sampling.lobes import MAX_EXPONENT, BlinnPhongMixture
from nacre.sampling.mixture import GgxMixture
from nacre.sampling.mixture_moment import MixtureMoment
from nacre.sampling.moment import Moment, second_moment

_COSINES = (0.1, 0.45, 1.0)  # of the views of the fit: a sphere shows hardly any lower ones
_STARTS = (0.02, 0.1, 0.4)  # roughnesses
_APART = 0.6  # how far from the one lobe's width a second one starts, either way
_WORTH = 1e-3  # smallest fraction of the cosine lobe's second moment that a mixture saves
_FIRST, _MORE = 10, 40  # steps of every start, and of the best
_EXPONENTS = np.geomspace(1.0, MAX_EXPONENT, 48)
_FRACTIONS = np.linspace(0.0, 0.98, 50)


class LobeSampledBrdf(Brdf):
    """A reflectance that samples itself by lobes fitted to it on first use."""

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # found once
        return fit_lobes(self)


def fit_lobes(brdf: Brdf, seed: int = 0) -> Sampler:
    """Lobes that sample a reflectance with the least variance: a :class:`GgxMixture` with four
    digits of each parameter, or the cosine lobe for what is black or diffuse.

    For a set of views, directions drawn from a broad proposal, which the seed chooses, estimate the
    second moment of f cos(theta_i) / p under the density p of a mixture (see
    :mod:`nacre.sampling.moment`). Newton steps lower it: from several roughnesses for a mixture
    with one lobe of GGX normals, then from that lobe in two parts. Lobes of an anisotropic material
    may stay with its axes.
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


def fit_blinn_phong(brdf: Brdf) -> BlinnPhongMixture:
    """The lobes of the NBRDF paper's section 3.3 that sample a reflectance with the least variance.

    The fraction and the exponent on a grid with the smallest second moment. Black gets the cosine
    lobe.
    """
    moment = second_moment(brdf)
    if not moment.weights.any():
        return BlinnPhongMixture(0.0, 1.0)
    wi, wo = split(moment.wi), split(moment.wo)
    # The fraction of the cosine lobe is kept above zero: it bounds every weight.
    cosine = wi[2] / math.pi
    best = (math.inf, 0.0, 1.0)
    for exponent in _EXPONENTS:
        lobe = BlinnPhongMixture(1.0, float(exponent)).pdf_components(wi, wo)
        for fraction in _FRACTIONS:
            second = float((moment.weights / (fraction * lobe + (1.0 - fraction) * cosine)).sum())
            best = min(best, (second, float(fraction), float(exponent)))
    return BlinnPhongMixture(best[1], best[2])


def _fit(moment: Moment, angle: float | None) -> tuple[float, GgxMixture]:
    """The smallest second moment found, and its mixture."""
    one, two = (MixtureMoment(moment, _COSINES, lobes, angle) for lobes in (1, 2))
    free = _best(one, [one.start((roughness,)) for roughness in _STARTS])[1]
    value, free = _best(two, [one.part(free, wider) for wider in (-_APART, _APART)])
    return value, two.mixture(free)


def _best(function: MixtureMoment, starts: list[Floats]) -> tuple[float, Floats]:
    """The smallest value found from some starts, the best of which goes on."""
    found = [minimize(function, start, _FIRST) for start in starts]
    return minimize(function, min(found, key=lambda pair: pair[0])[1], _MORE)


def _main_axis(moment: Moment) -> float:
    """Azimuth along which the half vectors of what is reflected spread most."""
    x, y, _ = half_vector(split(moment.wi), split(moment.wo))
    cosine, sine = (moment.weights * (x * x - y * y)).sum(), (moment.weights * x * y).sum()
    return float(f"{0.5 * math.atan2(2.0 * sine, cosine):.4g}")
