"""The density of codes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import kstest, multivariate_normal

from nacre.errors import NacreError
from nacre.latent.prior import ANYWHERE, ROUND, SCALES, WEIGHTS, Prior
from tests.latent.made import basis, random_basis, random_hypernetwork

CODES = np.array([[[-1.5, 0.2]], [[-1.1, 0.6]], [[0.9, -0.4]], [[1.4, 0.3]]])
PLANE = Prior.about(CODES)


def mixture(points):
    """The density of :data:`PLANE` by its definition and SciPy."""
    centers = CODES[:, 0]
    total = 0.0
    for weight, scale in zip(WEIGHTS, SCALES, strict=False):
        for center in centers:
            away = centers - center
            around = away.T @ away / 3
            around = (1 - ROUND) * around + ROUND * np.trace(around) / 2 * np.eye(2)
            total += weight / 4 * multivariate_normal(center, scale * around).pdf(points)
    for weight, variance in zip(WEIGHTS[2:], ANYWHERE, strict=True):
        total += weight * multivariate_normal(np.zeros(2), variance * np.eye(2)).pdf(points)
    return total


def test_the_density_is_the_mixture_and_integrates_to_one():
    axis = np.linspace(-12.0, 12.0, 241)
    points = np.stack(np.meshgrid(axis, axis), axis=-1)
    density = np.exp(PLANE.log_density(points))
    np.testing.assert_allclose(density, mixture(points), rtol=1e-9)
    assert density.sum() * 0.1**2 == pytest.approx(1.0, abs=1e-4)


def test_slopes_are_those_of_differences():
    prior, step = random_basis().prior, 1e-5
    codes = np.random.default_rng(1).normal(size=(5, 6))
    for index, row in enumerate(np.eye(6) * step):
        difference = prior.log_density(codes + row) - prior.log_density(codes - row)
        slope = prior.slope(codes)[:, index]
        np.testing.assert_allclose(slope, difference / (2 * step), rtol=1e-5, atol=1e-6)


def test_permuted_materials_are_as_plausible():
    made = random_basis()
    codes = np.random.default_rng(2).normal(size=(4, 6))
    logs = made.prior.log_density(codes)
    for order in range(6):
        permuted = made.permuted(codes, order)
        np.testing.assert_allclose(made.prior.log_density(permuted), logs, rtol=1e-6)


def test_samples_follow_the_density():
    found = PLANE.sample(4000, 3)
    np.testing.assert_array_equal(found, PLANE.sample(4000, 3))
    axis = np.linspace(-12.0, 12.0, 241)
    density = mixture(np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1))
    for side in range(2):
        sums = density.sum(axis=1 - side).cumsum()
        marginal = np.append(0.0, sums / sums[-1])
        edges = np.append(axis - 0.05, axis[-1] + 0.05)
        drawn = found[:, side]
        assert kstest(drawn, lambda x, m=marginal, e=edges: np.interp(x, e, m)).pvalue > 1e-3


def test_samples_are_like_the_materials_asked_for():
    made = random_basis()
    found = made.prior.sample(200, like=[2])
    away = [np.linalg.norm(made.examples - code, axis=1).argmin() for code in found]
    assert np.mean(np.array(away) == 2) > 0.6
    np.testing.assert_allclose(found.mean(axis=0), made.examples[2], atol=0.4)
    with pytest.raises(ValueError, match="no training material"):
        made.prior.sample(1, like=[])


def test_samples_around_a_code_have_the_covariance_of_its_neighbors():
    code = np.array([0.3, 0.1])
    found = PLANE.around(code, 20000, 4)
    np.testing.assert_array_equal(found, PLANE.around(code, 20000, 4))
    away = CODES[:, 0] - code
    covariance = away.T @ away / len(away)
    covariance = (1 - ROUND) * covariance + ROUND * np.trace(covariance) / 2 * np.eye(2)
    scale = np.dot(WEIGHTS[:2], SCALES) / sum(WEIGHTS[:2])
    np.testing.assert_allclose(found.mean(axis=0), code, atol=0.02)
    np.testing.assert_allclose(np.cov(found.T), scale * covariance, atol=0.02)


def test_an_implausible_code_moves_to_the_closest_plausible_one():
    level = PLANE.level()
    far = np.array([4.0, 5.0])
    assert PLANE.log_density(far) < level
    found = PLANE.project(far)
    assert PLANE.log_density(found) == pytest.approx(level, abs=1e-3)
    bound = {"type": "ineq", "fun": lambda c: PLANE.log_density(c) - level}
    best = min(
        minimize(lambda c: np.square(c - far).sum(), start, constraints=bound).fun
        for start in CODES[:, 0]
    )
    assert np.square(found - far).sum() == pytest.approx(best, rel=1e-3)
    np.testing.assert_array_equal(PLANE.project(CODES[2, 0]), CODES[2, 0])


def test_what_is_plausible_is_so_without_the_material_itself():
    centers = CODES[:, 0]
    logs = []
    for index, center in enumerate(centers):
        own = 0.0
        for weight, scale in zip(WEIGHTS, SCALES, strict=False):
            log = PLANE.blobs.logarithms[index] - np.log(scale)
            own += weight / 4 * np.exp(log)
        anywhere = sum(
            weight * multivariate_normal(np.zeros(2), variance * np.eye(2)).pdf(center)
            for weight, variance in zip(WEIGHTS[2:], ANYWHERE, strict=True)
        )
        about = mixture(center) - anywhere - own
        logs.append(np.log(about * 4 / 3 + anywhere))
    assert PLANE.level(0.3) == pytest.approx(np.quantile(logs, 0.3), rel=1e-9)


def test_few_materials_and_none():
    alone = Prior.about(np.zeros((1, 6, 3)))
    assert np.isfinite(alone.log_density(np.ones(3)))
    with pytest.raises(ValueError, match="two training materials"):
        alone.level()
    none = Prior.about(np.zeros((0, 6, 3)))
    assert none.log_density(np.zeros(3)) < alone.log_density(np.zeros(3))
    assert none.sample(5).shape == (5, 3)
    with pytest.raises(ValueError, match="not finite"):
        Prior.about(np.full((2, 1, 3), np.nan))


def test_bases_without_codes_of_materials_have_no_prior():
    assert random_hypernetwork().prior.code_dim == 6
    with pytest.raises(NacreError, match="'pca' does not know"):
        _ = basis().prior
