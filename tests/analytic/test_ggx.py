"""GGX against Mitsuba's `roughconductor`, and against numerical integrals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.analytic import AnisotropicGgx, Ggx
from nacre.brdf import Brdf
from nacre.geometry import split
from nacre.sampling import BlinnPhongMixture, GgxLobe, GgxMixture
from nacre.sampling.visible_normals import distribution
from tests.measured.support import hemisphere
from tests.mitsuba.reflectances import interaction
from tests.variants import require_mitsuba

ALPHAS = [(0.1, 0.1), (0.6, 0.6), (0.08, 0.4)]


def conductor(alpha, visible):
    """Mitsuba's BSDF of the same facets with a Fresnel term of 1."""
    mi = require_mitsuba()
    return mi, mi.load_dict(
        {
            "type": "roughconductor",
            "material": "none",
            "distribution": "ggx",
            "alpha_u": alpha[0],
            "alpha_v": alpha[1],
            "sample_visible": visible,
        }
    )


def directions(mi):
    random = np.random.default_rng(3)
    wi, wo = hemisphere(random, 3000), hemisphere(random, 3000)
    # Near the mirror direction too, where lobes are.
    wi[::2] = wo[::2] * [-1, -1, 1] + 0.05 * random.normal(size=(1500, 3))
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    keep = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    wi, wo = wi[keep].astype(np.float32), wo[keep].astype(np.float32)
    return wi, wo, interaction(mi, wo), mi.Vector3f(np.ascontiguousarray(wi.T))


@pytest.mark.parametrize("alpha", ALPHAS)
def test_the_density_of_visible_normals_is_mitsubas(alpha):
    mi, bsdf = conductor(alpha, visible=True)
    wi, wo, si, light = directions(mi)
    expected = np.array(bsdf.pdf(mi.BSDFContext(), si, light))
    lobe = GgxLobe((1.0,), (alpha[0],), (alpha[1],), (0.0,))
    ours = GgxMixture((lobe,), angle=0.0).pdf_components(split(wi), split(wo))
    np.testing.assert_allclose(ours, expected, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_the_distribution_of_normals_is_mitsubas(alpha):
    mi, bsdf = conductor(alpha, visible=False)
    wi, wo, si, light = directions(mi)
    expected = np.array(bsdf.pdf(mi.BSDFContext(), si, light))
    h = wi + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    ours = distribution(split(h), alpha) * h[:, 2] / (4 * (wo * h).sum(1))
    np.testing.assert_allclose(ours, expected, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_values_are_mitsubas_but_for_the_correlation_of_heights(alpha):
    mi, bsdf = conductor(alpha, visible=True)
    wi, wo, si, light = directions(mi)
    separable = np.array(bsdf.eval(mi.BSDFContext(), si, light))[0] / wi[:, 2]
    brdf = AnisotropicGgx(
        diffuse=(0, 0, 0),
        specular=(1, 1, 1),
        roughness_x=alpha[0],
        roughness_y=alpha[1],
        angle=0.0,
    )
    ours = brdf.eval(wi, wo)[:, 1]

    def masking(w):
        """Smith's G1 from his integral of slopes, Walter et al. 2007, equation 34."""
        slope2 = ((alpha[0] * w[:, 0]) ** 2 + (alpha[1] * w[:, 1]) ** 2) / w[:, 2] ** 2
        return 2 / (1 + np.sqrt(1 + slope2))

    one, other = masking(wi), masking(wo)
    # 1 / (1 + a + b) against 1 / ((1 + a) (1 + b)), where G1 = 1 / (1 + a).
    ratio = 1 / (1 / one + 1 / other - 1) / (one * other)
    np.testing.assert_allclose(ours, separable * ratio, rtol=3e-3, atol=1e-5)


@pytest.mark.parametrize("roughness", [0.02, 0.2, 1.0])
def test_projected_normals_integrate_to_one(roughness):
    tangent = np.linspace(0, 1, 200_001)[:-1] + 2.5e-6
    theta = np.arctan(roughness * tangent / (1 - tangent))
    h = np.sin(theta), 0 * theta, np.cos(theta)
    density = distribution(h, (roughness, roughness)) * np.cos(theta) * np.sin(theta)
    integral = 2 * math.pi * np.trapezoid(density, theta)
    assert integral == pytest.approx(1, abs=1e-4)


def albedo(brdf: Brdf, degrees: float, sampler) -> float:
    """Reflected share of light from one side, by a sampler that need not be the material's."""
    theta = math.radians(degrees)
    wo = np.tile([math.sin(theta), 0.0, math.cos(theta)], (200_000, 1))
    u = np.random.default_rng(5).random((200_000, 3))
    wi, density = sampler.sample_components(split(wo), split(u))
    above = (wi[2] > 0) & (density > 0)
    value = brdf.eval(np.stack(wi, -1), wo)[:, 1] * wi[2]
    return float(np.where(above, value / np.where(above, density, 1), 0).mean())


@pytest.mark.parametrize("degrees", [0, 50, 80])
@pytest.mark.parametrize("roughness", [0.05, 0.5])
def test_white_facets_reflect_what_mitsubas_do(roughness, degrees):
    mi, bsdf = conductor((roughness, roughness), visible=True)
    theta = math.radians(degrees)
    view = np.tile(np.array([math.sin(theta), 0, math.cos(theta)], np.float32), (200_000, 1))
    u = np.random.default_rng(6).random((3, 200_000), np.float32)
    drawn, weight = bsdf.sample(
        mi.BSDFContext(), interaction(mi, view), mi.Float(u[0]), mi.Point2f(u[1:])
    )
    expected = np.where(np.array(drawn.wo.z) > 0, np.array(weight)[0], 0).mean()
    brdf = Ggx(diffuse=(0, 0, 0), specular=(1, 1, 1), roughness=roughness)
    reflected = albedo(brdf, degrees, brdf.sampler)
    assert reflected == pytest.approx(
        albedo(brdf, degrees, BlinnPhongMixture(0.8, 1 / roughness**2)), rel=0.02
    )
    if degrees == 0:
        # Nothing hides a normal from straight above: correlation of heights is no matter.
        assert reflected == pytest.approx(expected, rel=0.01)
    assert 0.995 * expected < reflected < 1.001


def test_turning_the_axes_turns_the_material():
    options = {"diffuse": (0.1, 0.1, 0.1), "specular": (0.5, 0.4, 0.3)}
    angle = 0.7
    plain = AnisotropicGgx(roughness_x=0.1, roughness_y=0.4, angle=0.0, **options)
    turned = AnisotropicGgx(roughness_x=0.1, roughness_y=0.4, angle=angle, **options)
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    random = np.random.default_rng(1)
    wi, wo = (hemisphere(random, 500).astype(np.float64) for _ in range(2))
    np.testing.assert_allclose(
        turned.eval(wi @ matrix.T, wo @ matrix.T), plain.eval(wi, wo), rtol=1e-9
    )
    np.testing.assert_allclose(
        turned.pdf(wi @ matrix.T, wo @ matrix.T), plain.pdf(wi, wo), rtol=1e-9
    )
