"""Fits of lobes: the variance they are fitted by is that of sampling, and they lower it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from nacre.analytic import AnisotropicGgx
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.geometry import join, split
from nacre.numerics.newton import minimize
from nacre.sampling import GgxMixture, fit_blinn_phong, fit_lobes
from nacre.sampling.mixture_moment import MixtureMoment
from nacre.sampling.moment import second_moment
from nacre.sampling.sequence import even_points

from .mixtures import steady
from .reflectances import Shiny


def sampled_moment(brdf: Brdf, sampler: Sampler, degrees: float) -> float:
    """Second moment relative to the squared mean, by sampling."""
    theta = math.radians(degrees)
    wo = np.tile([math.sin(theta), 0.0, math.cos(theta)], (100_000, 1))
    u = split(np.random.default_rng(1).random((100_000, 3)))
    wi, density = sampler.sample_components(split(wo), u)
    value = brdf.eval(join(wi), wo)[:, 0] * wi[2]
    weights = np.where(density > 0, value / np.where(density > 0, density, 1.0), 0.0)
    return float((weights**2).mean() / weights.mean() ** 2)


DEGREES = (10, 45, 70)


@pytest.mark.parametrize("exponent", [20.0, 500.0, 20000.0])
def test_fitted_lobes_beat_the_best_blinn_phong_lobe(exponent: float) -> None:
    brdf = Shiny(0.3, 0.3, exponent)
    cosine, phong, ours = (
        [sampled_moment(brdf, sampler, degrees) for degrees in DEGREES]
        for sampler in (CosineSampler(), fit_blinn_phong(brdf), fit_lobes(brdf))
    )
    # Half vectors of the highlight are Blinn-Phong's own, but not of all views alike.
    assert np.mean(ours) - 1.0 < 0.5 * (np.mean(phong) - 1.0)
    assert np.mean(phong) < np.mean(cosine)
    assert max(ours) < 1.5


@pytest.mark.parametrize("sampler", [CosineSampler(), steady(0.5, 0.1), steady(0.9, 0.4, 0.5)])
def test_the_moment_is_that_of_sampling(sampler: Sampler) -> None:
    brdf = Shiny(0.3, 0.3, 200.0)
    moment = second_moment(brdf)
    wi, wo = split(moment.wi), split(moment.wo)
    density = sampler.pdf_components(wi, wo)
    sine2 = 1.0 - moment.wo[:, 0, 2] ** 2
    for view in (1, 4, 6):
        mine = float((moment.weights[view] / density[view]).sum())
        expected = sampled_moment(brdf, sampler, math.degrees(math.asin(math.sqrt(sine2[view]))))
        share = 0.5 * np.polynomial.legendre.leggauss(len(sine2))[1][view]
        assert mine / (share / 1.01) == pytest.approx(expected, rel=0.06)


@pytest.mark.parametrize(("lobes", "angle"), [(1, None), (2, None), (2, 0.4)])
def test_slopes_are_differences(lobes: int, angle: float | None) -> None:
    function = MixtureMoment(second_moment(Shiny(0.2, 0.3, 80.0)), (0.2, 1.0), lobes, angle)
    start = function.start((0.05, 0.3)[:lobes])
    start += 0.1 * np.random.default_rng(0).normal(size=start.shape)
    value, gradient, hessian = function(start)
    assert function.mixture(start).angle == angle
    eye, step = np.eye(len(start)), 1e-5
    slopes = [(function(start + step * e)[0] - function(start - step * e)[0]) / 2 for e in eye]
    np.testing.assert_allclose(gradient, np.array(slopes) / step, rtol=1e-3, atol=1e-4 * value)
    assert np.linalg.eigvalsh(hessian).min() > -1e-9 * value


def test_the_mixture_of_parameters_has_their_moment() -> None:
    moment = second_moment(Shiny(0.2, 0.3, 80.0))
    function = MixtureMoment(moment, (0.2, 1.0), 1, None)
    one = function.start((0.15,))
    for free in (one, one + 0.3):
        density = function.mixture(free).pdf_components(split(moment.wi), split(moment.wo))
        expected = float((moment.weights / density).sum())
        assert function(free)[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("albedo", [0.0, 0.5])
def test_black_and_matt_get_the_cosine_lobe(albedo: float) -> None:
    brdf = Shiny(albedo, 0.0, 1.0)
    assert isinstance(fit_lobes(brdf), CosineSampler)
    assert fit_blinn_phong(brdf).specular == 0.0


def test_what_is_not_finite_does_not_count() -> None:
    class Wild(Shiny):
        def eval_components(self, wi, wo):
            red, green, _ = super().eval_components(wi, wo)
            return red, green, np.where(wi[0] > 0.9, np.nan, red)

    sampler = fit_lobes(Wild(0.3, 0.3, 80.0))
    assert isinstance(sampler, GgxMixture)
    assert sampled_moment(Shiny(0.3, 0.3, 80.0), sampler, 45) < 1.2


def test_the_same_seed_fits_the_same_lobes() -> None:
    brdf = Shiny(0.2, 0.2, 50.0)
    assert fit_lobes(brdf, 3) == fit_lobes(brdf, 3)
    assert fit_lobes(brdf, 3) != fit_lobes(brdf, 4)


def test_newton_steps_find_a_valley_that_bends() -> None:
    def banana(x):  # as residuals (10 (y - x^2), 1 - x), the Hessian is that of Gauss and Newton
        r = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
        jacobian = np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])
        return float(r @ r), 2.0 * jacobian.T @ r, 2.0 * jacobian.T @ jacobian

    value, x = minimize(banana, np.array([-1.2, 1.0]), 60, 1e-14)
    assert value < 1e-10
    np.testing.assert_allclose(x, 1.0, atol=1e-4)


def test_even_points_fill_the_cube() -> None:
    # Steps of the R2 sequence as Roberts gives them.
    np.testing.assert_allclose(even_points(2, 2, 0.0)[1], [0.75487766624669, 0.56984029099805])
    for dimensions in (2, 4):
        points = even_points(4096, dimensions)
        assert ((points >= 0) & (points < 1)).all()
        cells = np.ravel_multi_index((points * 4).astype(int).T, (4,) * dimensions)
        counts = np.bincount(cells, minlength=4**dimensions)
        mean = 4096 / 4**dimensions
        assert counts.var() < 0.5 * mean  # of random points it is the mean


@pytest.mark.parametrize("angle", [-1.2, 0.3, 0.9])
def test_lobes_of_an_anisotropic_material_stay_with_its_axes(angle: float) -> None:
    brdf = AnisotropicGgx(
        diffuse=(0.1,) * 3, specular=(0.5,) * 3, roughness_x=0.4, roughness_y=0.08, angle=angle
    )
    sampler = fit_lobes(brdf)
    assert isinstance(sampler, GgxMixture)
    assert sampler.angle is not None
    assert abs(math.sin(sampler.angle - angle)) < 0.05
    for degrees in DEGREES:
        assert sampled_moment(brdf, sampler, degrees) < 1.15
        assert sampled_moment(brdf, fit_blinn_phong(brdf), degrees) > 1.5


def test_a_lobe_is_parted_in_two_about_itself() -> None:
    moment = second_moment(Shiny(0.2, 0.3, 80.0))
    one, two = (MixtureMoment(moment, (0.2, 1.0), lobes, None) for lobes in (1, 2))
    free = one.start((0.15,)) + 0.1
    assert two(one.part(free, 0.0))[0] == pytest.approx(one(free)[0])
    narrow, wide = two.mixture(one.part(free, 0.5)).lobes
    assert narrow == replace(one.mixture(free).lobes[0], fraction=narrow.fraction)
    assert wide.fraction == narrow.fraction
    assert wide.shift == narrow.shift
    assert min(wide.roughness + wide.across) > max(narrow.roughness + narrow.across)
