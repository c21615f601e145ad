"""Search of the best cosine and Blinn-Phong lobes."""

from __future__ import annotations

import math

import numpy as np

from nacre.brdf import Brdf
from nacre.geometry import split
from nacre.sampling.lobes import MAX_EXPONENT, BlinnPhongMixture
from nacre.sampling.moment import second_moment

_EXPONENTS = np.geomspace(1.0, MAX_EXPONENT, 48)
_SHARES = np.linspace(0.0, 0.98, 50)


def fit_blinn_phong(brdf: Brdf, seed: int = 0) -> BlinnPhongMixture:
    """The lobes of the NBRDF paper's section 3.3 that sample a reflectance with the least variance.

    The share and the exponent with the smallest second moment of all that a grid holds.

    Parameters
    ----------
    brdf
        Any reflectance; what is not reflected is not sampled, so black gets the cosine lobe.
    seed
        Of the directions that estimate the variance.
    """
    moment = second_moment(brdf, seed)
    if not moment.weights.any():
        return BlinnPhongMixture(0.0, 1.0)
    wi, wo = split(moment.wi), split(moment.wo)
    # The share of the cosine lobe is kept above zero: it bounds every weight.
    cosine = wi[2] / math.pi
    best = (math.inf, 0.0, 1.0)
    for exponent in _EXPONENTS:
        lobe = BlinnPhongMixture(1.0, float(exponent)).pdf_components(wi, wo)
        for share in _SHARES:
            second = float((moment.weights / (share * lobe + (1.0 - share) * cosine)).sum())
            best = min(best, (second, float(share), float(exponent)))
    return BlinnPhongMixture(best[1], best[2])
