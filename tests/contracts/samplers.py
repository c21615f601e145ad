"""One sampler of every kind, sharp and broad."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nacre.brdf import CosineSampler, Sampler
from nacre.measured.microfacet_warp import microfacet_sampler
from nacre.measured.rgl_writer import Resolution
from nacre.sampling import BlinnPhongMixture, UniformSampler, fit_lobes
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from nacre.sampling.tilted import TiltedMixture
from tests.analytic.materials import EXAMPLES
from tests.contracts.materials import ANISOTROPIC, CODE, MATERIALS, made, network, rgl_table
from tests.latent.made import predictor
from tests.reflectances import Brushed, Glossy
from tests.sampling.mixtures import MIXTURES

SAMPLERS: dict[str, Callable[[], Sampler]] = {
    "cosine": CosineSampler,
    "uniform": UniformSampler,
    "broad Blinn-Phong": lambda: BlinnPhongMixture(0.5, 5.0),
    "sharp Blinn-Phong": lambda: BlinnPhongMixture(1.0, 5000.0),
    "sharpest Blinn-Phong": lambda: BlinnPhongMixture(0.7, 1e5),
    **{name: lambda mixture=mixture: mixture for name, mixture in MIXTURES.items()},
    "tilted": lambda: TiltedMixture(0.8, 0.3, (0.2, -0.4)),
    "tilted and sharp": lambda: TiltedMixture(0.6, 0.05, (-0.3, 0.1)),
    "lobes of a network": lambda: fit_lobes(network(True)),
    "lobes of an anisotropic network": lambda: fit_lobes(network(False)),
    **{
        f"predicted: {name}": lambda name=name: predictor(name, scale=0.3)(CODE)
        for name in PARAMETRIZATIONS
    },
    "ggx": lambda: EXAMPLES["ggx"].sampler,
    "ggx-anisotropic": lambda: EXAMPLES["ggx-anisotropic"].sampler,
    "microfacets": lambda: microfacet_sampler(Glossy(0.2, 0.1, 0.4)),
    "sharp microfacets": lambda: microfacet_sampler(Glossy(0.1, 0.5, 0.03)),
    "anisotropic microfacets": lambda: microfacet_sampler(Brushed(), Resolution(6, 9, 8, 16, 16)),
    "isotropic warp": lambda: rgl_table((0.0,)).sampler,
    "anisotropic warp": lambda: rgl_table(ANISOTROPIC).sampler,
    **{
        f"warp of {name}": lambda name=name: made(name).sampler
        for name in ("satin_rosaline_rgb.bsdf", "paper_white_rgb.bsdf")
        if name in MATERIALS
    },
    "warp of half a turn": lambda: rgl_table(tuple(np.linspace(-np.pi, 0.0, 4))).sampler,
}
"""By name."""
