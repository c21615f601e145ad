"""Microfacets by power iteration: their samples, and their bytes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.analytic.factor import half_angles
from nacre.brdf import Brdf
from nacre.sampling.sequence import even_points
from nacre_lab.reproduce.extracted import ExtractedMicrofacets, NormalSampler

WO = np.array([0.5, 0.1, math.sqrt(1.0 - 0.26)])
U = even_points(1 << 16, 3)


def ggx(alpha: float) -> np.ndarray:
    cosine = np.cos(half_angles())
    return alpha**2 / (math.pi * (cosine**2 * (alpha**2 - 1.0) + 1.0) ** 2)


@pytest.mark.parametrize("alpha", [0.03, 0.3, 1.0])
def test_samples_have_the_density_that_they_say(alpha: float) -> None:
    sampler = NormalSampler(ggx(alpha))
    brdf = Ggx(diffuse=(0.2,) * 3, specular=(0.4,) * 3, roughness=alpha, sampler=sampler)
    wi, pdf = brdf.sample(WO, U)
    up = pdf > 0.0
    np.testing.assert_allclose(brdf.pdf(wi[up], WO), pdf[up], rtol=2e-3)
    # What is reflected, by these samples and by those of the material itself.
    own = Ggx(diffuse=(0.2,) * 3, specular=(0.4,) * 3, roughness=alpha)
    albedos = [albedo(brdf), albedo(own)]
    assert albedos[0] == pytest.approx(albedos[1], rel=0.03)


def albedo(brdf: Brdf) -> float:
    wi, pdf = brdf.sample(WO, U)
    weight = np.divide(wi[:, 2], pdf, out=np.zeros_like(pdf), where=pdf > 0.0)
    return float((brdf.eval(wi, WO)[:, 0] * weight).mean())


def test_normals_are_drawn_as_often_as_there_are() -> None:
    sampler = NormalSampler(ggx(0.2))
    up = np.array([0.0, 0.0, 1.0])
    wi, pdf = Ggx(diffuse=(0.0,) * 3, specular=(1.0,) * 3, roughness=0.2, sampler=sampler).sample(
        up, U
    )
    half = 0.5 * np.arccos(np.clip(wi[:, 2], -1.0, 1.0))
    for angle in (0.1, 0.2, 0.5):
        below = math.tan(angle) ** 2 / (math.tan(angle) ** 2 + 0.04)  # in closed form, of GGX
        expected = 0.99 * below + 0.01 * math.sin(angle) ** 2
        assert np.mean((half < angle) & (pdf > 0.0)) == pytest.approx(expected, abs=0.004)


def test_it_takes_the_papers_bytes() -> None:
    found = ExtractedMicrofacets(Ggx(diffuse=(0.1,) * 3, specular=(0.5,) * 3, roughness=0.3))
    assert found.nbytes == 2160
    wi = np.array([-0.5, -0.1, WO[2]])
    truth = Ggx(diffuse=(0.1,) * 3, specular=(0.5,) * 3, roughness=0.3).eval(wi, WO)
    np.testing.assert_allclose(found.eval(wi, WO), truth, rtol=0.2)
