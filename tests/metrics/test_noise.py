"""The variance of samples: against closed forms, and against samples that are drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.array import Array, Components, namespace
from nacre.brdf import Brdf, Sampler
from nacre.metrics.noise import sampling_variance
from nacre.sampling import UniformSampler

GRAY = MODELS["lambert"](diffuse=(0.5, 0.5, 0.5))


def drawn(brdf: Brdf, count: int = 30_000) -> float:
    """The same by samples: mean over views of a sphere, whose squared sines are uniform."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    random, total = np.random.default_rng(5), 0.0
    for squared, part in zip(0.5 * (1.0 + nodes), 0.5 * weights, strict=True):
        wo = np.broadcast_to([math.sqrt(squared), 0.0, math.sqrt(1.0 - squared)], (count, 3))
        wi, pdf = brdf.sample(wo, random.random((count, 3)))
        reflected = brdf.eval(wi, wo) * wi[:, 2:]
        value = np.where(pdf[:, None] > 0.0, reflected / np.maximum(pdf, 1e-30)[:, None], 0.0)
        mean = value.mean(axis=0)
        scale = mean**2 + (0.1 * mean.max()) ** 2
        total += part * float((value.var(axis=0) / scale).mean())
    return total


@pytest.mark.parametrize("name", ["merl:chrome", "rgl:cg_sunflower"])
def test_it_is_that_of_samples_drawn(name: str) -> None:
    brdf = nacre.load(name)
    assert isinstance(brdf, Brdf)
    assert sampling_variance(brdf) == pytest.approx(drawn(brdf), rel=0.05)


def test_gray_has_closed_forms() -> None:
    assert sampling_variance(GRAY) == pytest.approx(0.0, abs=1e-12)
    # Of directions uniform over the hemisphere 2 rho cos: a third of the squared albedo.
    uniform = GRAY.replaced(sampler=UniformSampler())
    assert sampling_variance(uniform) == pytest.approx(1.0 / 3.0 / 1.01, rel=0.02)


@dataclass(frozen=True)
class Blind(Sampler):
    """Draws the normal's half of the hemisphere's cosines only."""

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        xp = namespace(*wo, *u)
        z = 0.5 + 0.5 * u[0]
        wi = xp.sqrt(1.0 - z * z), 0.0 * z, z
        return wi, self.pdf_components(wi, wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        xp = namespace(*wi, *wo)
        return xp.where(wi[2] > 0.5, 1.0 / math.pi, 0.0) + 0.0 * wo[2]


def test_what_is_never_sampled_makes_it_infinite_and_black_has_none() -> None:
    assert sampling_variance(GRAY.replaced(sampler=Blind())) == math.inf
    assert math.isnan(sampling_variance(MODELS["lambert"](diffuse=(0.0, 0.0, 0.0))))
