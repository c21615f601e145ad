"""Samplers from microfacets: densities of what is drawn, and what they bring."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.errors import FormatError
from nacre.geometry import join, split
from nacre.measured.microfacet_warp import microfacet_sampler
from nacre.measured.rgl_writer import Resolution
from nacre.sampling.moment import second_moment
from tests.reflectances import Glossy

COUNT = 100_000
GLOSSY = Glossy(0.02, 0.5, 0.15)


def view(degrees: float) -> np.ndarray:
    theta = math.radians(degrees)
    wo = [0.8 * math.sin(theta), 0.6 * math.sin(theta), math.cos(theta)]
    return np.broadcast_to(wo, (COUNT, 3))


@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
@pytest.mark.parametrize("brdf", [GLOSSY, Glossy(0.1, 0.3, 0.3, 0.5)], ids=["iso", "aniso"])
def test_the_density_integrates_to_the_share_of_samples_above_the_horizon(
    brdf: Brdf, degrees: float
) -> None:
    sampler, wo = microfacet_sampler(brdf, Resolution(25, 12, 2, 24, 48)), view(degrees)
    u = np.random.default_rng(0).random((COUNT, 3))
    wi, pdf = sampler.sample_components(split(wo), split(u))
    np.testing.assert_allclose(np.linalg.norm(join(wi), axis=-1), 1.0, atol=1e-6)
    np.testing.assert_allclose(
        sampler.pdf_components(wi, split(wo))[pdf > 0], pdf[pdf > 0], rtol=0.01
    )
    even, density = CosineSampler().sample_components(split(wo), split(u))
    ratio = sampler.pdf_components(even, split(wo)) / density
    spread = ratio.std() / math.sqrt(COUNT) + 1.0 / math.sqrt(COUNT)
    assert abs(ratio.mean() - (pdf > 0).mean()) < 5.0 * spread
    assert (sampler.pdf_components(even, split(wo))[even[2] > 1e-3] > 0).all()


def moment(brdf: Brdf, sampler: Sampler) -> float:
    seen = second_moment(brdf, 5)
    return float((seen.weights / sampler.pdf_components(split(seen.wi), split(seen.wo))).sum())


def test_what_microfacets_reflect_is_sampled_by_them() -> None:
    assert moment(GLOSSY, microfacet_sampler(GLOSSY)) < 0.5 * moment(GLOSSY, CosineSampler())
    assert str(microfacet_sampler(GLOSSY)) == "visible normals by power iteration"


def test_an_anisotropic_material_needs_azimuths() -> None:
    with pytest.raises(FormatError, match="is anisotropic"):
        microfacet_sampler(Glossy(0.1, 0.3, 0.1, 0.3), Resolution(2, 12, 2, 24, 48))
