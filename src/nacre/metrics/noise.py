"""How noisy a reflectance is with its own sampler."""

from __future__ import annotations

import math

import numpy as np

from nacre.brdf import Brdf
from nacre.sampling.moment import propose

_DARK = 0.1
"""Albedo of a channel, relative to the brightest, below which its noise counts less."""
_PER_VIEW = 4096
_SEED = 1  # of the directions: others than those that lobes are fitted to


def sampling_variance(brdf: Brdf) -> float:
    """Variance of one sample f_r cos(theta_i) / p, relative to the squared albedo.

    The mean over channels, and over views as an orthographic picture of a sphere has them; that of
    n samples is the n-th part. It is integrated over directions that do not depend on the material
    (:func:`nacre.sampling.moment.propose`), so that what a sampler hardly ever finds counts too.

    From 0 up; infinite where light is reflected that the sampler never finds; NaN for black.
    """
    proposal = propose(_SEED, _PER_VIEW)
    wi, wo, density = proposal.wi, proposal.wo, proposal.density
    above = np.isfinite(density)
    with np.errstate(all="ignore"):  # a wild reflectance may overflow
        value = np.nan_to_num(brdf.eval(wi, wo) * wi[..., 2:], posinf=0.0) * above[..., None]
    pdf = brdf.pdf(wi, wo) * above
    if (value.max(axis=-1) > 0.0)[pdf == 0.0].any():
        return math.inf
    weight = value / np.where(pdf > 0.0, pdf, 1.0)[..., None]
    share = (pdf / density)[..., None]
    share /= np.maximum(share.sum(axis=-2, keepdims=True), 1e-300)
    mean = (share * weight).sum(axis=-2, keepdims=True)
    spread = (share * (weight - mean) ** 2).sum(axis=-2, keepdims=True)
    # Samples below the horizon count as 0; how many there are is what the sampler draws.
    u = np.random.default_rng(_SEED).random(wo.shape)
    drawn = (brdf.sample(wo, u)[1] > 0.0).mean(axis=-1)[:, None, None]
    albedo = drawn * mean
    scale = albedo**2 + (_DARK * albedo.max(axis=-1, keepdims=True)) ** 2
    if not scale.all():
        return math.nan
    relative = (drawn * (spread + (1.0 - drawn) * mean**2) / scale).mean(axis=(-2, -1))
    return float((proposal.fractions * relative).sum())
