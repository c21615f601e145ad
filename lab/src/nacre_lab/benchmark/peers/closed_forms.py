"""The peers by name."""

from __future__ import annotations

from nacre import analytic
from nacre.brdf import Brdf
from nacre_lab.benchmark.peers import gaussian_process
from nacre_lab.benchmark.peers.spherical_gaussians import SphericalGaussians
from nacre_lab.reproduce.methods import GAIN
from nacre_lab.reproduce.trial import Method, Settings

SIZES = 600, 1350, 5250
"""Bytes that Gaussian processes may take: those of small, default and large networks."""


def closed_form_peers(settings: Settings) -> dict[str, Method]:
    """Methods that fit without training a network; none is the code of its authors."""
    options = {"gain": GAIN, "seed": settings.seed}

    def gaussians(brdf: Brdf) -> Brdf:
        return analytic.fit(brdf, SphericalGaussians, gain=GAIN, seed=settings.seed)

    about = f"microfacets of six spherical Gaussians, loss gain {GAIN:g}; our own implementation"
    return {
        **{f"gaussian-process-{nbytes}": _process(nbytes, settings.seed) for nbytes in SIZES},
        SphericalGaussians.model: Method(about, gaussians, "analytic", options),
    }


def _process(nbytes: int, seed: int) -> Method:
    about = "Gaussian process at points chosen greedily, half precision; our own implementation"

    def fit(brdf: Brdf) -> Brdf:
        return gaussian_process.fit(brdf, nbytes, seed)

    return Method(about, fit, "analytic", {"bytes": nbytes, "seed": seed})
