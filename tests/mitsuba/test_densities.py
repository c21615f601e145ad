"""The samples that plugins draw follow their densities, and these are NumPy's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nacre.mitsuba
from tests.sampling.mixtures import MIXTURES
from tests.tiers import tiered

from .chi_square import chi_square
from .reflectances import PUBLISHED, interaction, network, reflectance

Pairs = tuple[np.ndarray, np.ndarray]

GRAZING = (0.0, 30.0, 60.0, 85.0)
LOBES = [
    *((s, n, a) for s, n in ((0.0, 1.0), (1.0, 1.0), (0.5, 50.0)) for a in (0.0, 45.0, 80.0)),
    *((s, n, a) for s, n in ((1.0, 50.0), (0.5, 2000.0)) for a in (30.0, 80.0)),
    *((s, 50000.0, a) for s in (0.5, 1.0) for a in (45.0, 80.0)),
]


@pytest.mark.parametrize("name", ["random1", "random2", "constant"])
@pytest.mark.parametrize(("specular", "exponent", "degrees"), tiered(LOBES, LOBES[::6]))
def test_samples_follow_the_density(
    rgb: Any, name: str, specular: float, exponent: float, degrees: float
) -> None:
    sampler = nacre.sampling.BlinnPhongMixture(specular, exponent)
    brdf = reflectance(name).replaced(sampler=sampler)
    test = chi_square(rgb, nacre.mitsuba.bsdf(brdf), degrees)
    assert test.run(test_count=3 * len(LOBES), quiet=True), test.messages


@pytest.mark.parametrize(
    "name",
    tiered(
        [*PUBLISHED, "satin_rosaline measured", "cc_ibiza_sunset tabulated"],
        [*PUBLISHED[:1], "satin_rosaline measured"],
    ),
)
@pytest.mark.parametrize("degrees", tiered([30.0, 60.0, 80.0], [60.0]))
def test_samples_of_real_materials_follow_the_density(rgb: Any, name: str, degrees: float) -> None:
    test = chi_square(rgb, nacre.mitsuba.bsdf(reflectance(name)), degrees)
    assert test.run(test_count=15, quiet=True), test.messages


@pytest.mark.parametrize(("specular", "exponent"), [(0.0, 1.0), (0.5, 50.0), (1.0, 50000.0)])
def test_a_density_that_is_off_is_found(rgb: Any, specular: float, exponent: float) -> None:
    brdf = network(1, specular, exponent)
    for distort in (lambda pdf, wo: 1.03 * pdf, lambda pdf, wo: pdf * (1.0 + 0.1 * wo.x)):
        assert not chi_square(rgb, nacre.mitsuba.bsdf(brdf), 45.0, distort).run(quiet=True)


# The grid of the test resolves a lobe of roughness 0.0045 neither at the pole nor where the view
# grazes and it is a tenth as wide across; the means of tests/sampling cover it there.
@pytest.mark.parametrize(
    ("name", "degrees"),
    tiered(
        [(m, a) for m in MIXTURES for a in GRAZING if m != "sharp" or 0.0 < a < 80.0],
        lambda case: case[1] == GRAZING[len(GRAZING) // 2],
    ),
)
def test_samples_of_ggx_mixtures_follow_the_density(rgb: Any, name: str, degrees: float) -> None:
    brdf = network(1).replaced(sampler=MIXTURES[name])
    test = chi_square(rgb, nacre.mitsuba.bsdf(brdf), degrees)
    assert test.run(test_count=len(MIXTURES) * len(GRAZING), quiet=True), test.messages


@pytest.mark.parametrize("name", ["sharp and diffuse", "two lobes"])
def test_a_density_of_ggx_that_is_off_is_found(rgb: Any, name: str) -> None:
    brdf = network(1).replaced(sampler=MIXTURES[name])
    for distort in (lambda pdf, wo: 1.06 * pdf, lambda pdf, wo: pdf * (1.0 + 0.1 * wo.x)):
        assert not chi_square(rgb, nacre.mitsuba.bsdf(brdf), 45.0, distort).run(quiet=True)


@pytest.mark.parametrize("name", MIXTURES)
def test_densities_of_ggx_mixtures_are_numpys(rgb: Any, directions: Pairs, name: str) -> None:
    brdf, (wi, wo) = network(1).replaced(sampler=MIXTURES[name]), directions
    bsdf, context = nacre.mitsuba.bsdf(brdf), rgb.BSDFContext()
    si, light = interaction(rgb, wo), rgb.Vector3f(np.ascontiguousarray(wi.T))
    expected = brdf.pdf(wi, wo)
    assert (expected > 0).mean() > 0.2
    np.testing.assert_allclose(np.array(bsdf.pdf(context, si, light)), expected, rtol=1e-3)
    u = np.random.default_rng(0).random((len(wo), 3)).astype(np.float32)
    drawn, density = brdf.sample(wo, u)
    sample, _ = bsdf.sample(context, si, rgb.Float(u[:, 0]), rgb.Point2f(u[:, 1:].T))
    known = density > 0
    np.testing.assert_allclose(np.array(sample.wo).T[known], drawn[known], atol=2e-5)
    again = brdf.pdf(drawn.astype(np.float64), wo.astype(np.float64))
    np.testing.assert_allclose(density[known], again[known], rtol=5e-3)
