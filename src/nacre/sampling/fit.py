"""Fit of the importance sampling lobes to a material."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import luminance
from nacre.geometry import cosine_hemisphere, join, split
from nacre.sampling.lobes import MAX_EXPONENT, BlinnPhongMixture

_VIEWS = (0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
"""Squared sines of the views that the lobes are fitted at: every view of a sphere counts alike."""
_PER_VIEW = 1024
_EXPONENTS = np.geomspace(1.0, MAX_EXPONENT, 48)
_SHARES = np.linspace(0.0, 0.98, 50)


def fit_lobes(brdf: Brdf, seed: int = 0) -> BlinnPhongMixture:
    """Lobes that sample a reflectance with the least variance.

    For a set of views, directions drawn from a broad proposal estimate the second moment of
    f cos(theta_i) / p under the density p of every candidate; the share and exponent with the
    smallest, summed over views relative to their albedo, are chosen.

    Parameters
    ----------
    brdf
        Any reflectance; what is not reflected is not sampled, so black gets the cosine lobe.
    seed
        Of the proposal's directions.
    """
    with np.errstate(all="ignore"):  # of a wild reflectance, what is not finite does not count
        return _search(brdf, *_directions(seed))


def _search(brdf: Brdf, wo: Floats, wi: Floats, proposal: Floats) -> BlinnPhongMixture:
    value = luminance(split(brdf.eval(wi, wo))).astype(np.float64) * wi[..., 2]
    value = np.where(np.isfinite(value), value, 0.0)
    weight = value**2 / proposal
    albedo = (value / proposal).mean(axis=1, keepdims=True)
    weight /= np.maximum(albedo, 1e-12) ** 2
    weight = np.where(np.isfinite(weight), weight, 0.0)
    if not weight.any():
        return BlinnPhongMixture(0.0, 1.0)
    # The share of the cosine lobe is kept above zero: it bounds every weight.
    cosine = wi[..., 2] / math.pi
    best = (math.inf, 0.0, 1.0)
    for exponent in _EXPONENTS:
        lobe = BlinnPhongMixture(1.0, float(exponent)).pdf_components(split(wi), split(wo))
        for share in _SHARES:
            moment = float((weight / (share * lobe + (1.0 - share) * cosine)).sum())
            best = min(best, (moment, float(share), float(exponent)))
    return BlinnPhongMixture(best[1], best[2])


def _directions(seed: int) -> tuple[Floats, Floats, Floats]:
    """Views (v, n, 3) at all azimuths, lights (v, n, 3) and the density of the lights (v, n)."""
    random = np.random.default_rng(seed)
    sine2 = np.repeat(np.array(_VIEWS)[:, None], _PER_VIEW, axis=1)
    phi = random.uniform(0.0, 2.0 * math.pi, sine2.shape)
    sine = np.sqrt(sine2)
    wo = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1.0 - sine2)], axis=-1)
    # A stack of lobes from broad to sharp sees highlights of every width.
    lobes = [BlinnPhongMixture(0.8, float(n)) for n in np.geomspace(1.0, MAX_EXPONENT, 8)]
    u = random.random((*sine2.shape, 3))
    wi = join(cosine_hemisphere(u[..., 1], u[..., 2]))
    for k, lobe in enumerate(lobes):
        part = np.s_[:, k :: len(lobes)]
        drawn, _ = lobe.sample_components(split(wo[part]), split(u[part]))
        wi[part] = join(drawn)
    density = sum(lobe.pdf_components(split(wi), split(wo)) for lobe in lobes) / len(lobes)
    below = wi[..., 2] <= 0
    wi[below] = (0.0, 0.0, 1.0)
    return wo, wi, np.where(below, np.inf, density)
