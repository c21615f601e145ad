"""Importance sampling: lobe mixtures with exact densities, and their fit to a material. Samples of
a material.
"""

from nacre.sampling.fit import LobeSampledBrdf, fit_blinn_phong, fit_lobes
from nacre.sampling.isotropy import check_isotropic
from nacre.sampling.lobes import BlinnPhongMixture, UniformSampler
from nacre.sampling.mixture import GgxLobe, GgxMixture
from nacre.sampling.registry import SAMPLERS, describe_sampler, make_sampler
from nacre.sampling.uniform import DISTRIBUTIONS, draw_samples

__all__ = [
    "DISTRIBUTIONS",
    "SAMPLERS",
    "BlinnPhongMixture",
    "GgxLobe",
    "GgxMixture",
    "LobeSampledBrdf",
    "UniformSampler",
    "check_isotropic",
    "describe_sampler",
    "draw_samples",
    "fit_blinn_phong",
    "fit_lobes",
    "make_sampler",
]
