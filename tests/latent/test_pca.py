"""Principal components against a dense singular value decomposition, and what codes do."""

from __future__ import annotations

import itertools
import math
from functools import partial

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.brdf import Brdf
from nacre.errors import FormatError, NacreError
from nacre.latent import PcaBasis, PcaRecipe
from nacre.latent.pca import EPSILON, node_cosines
from nacre.measured import MerlBrdf
from nacre.measured.merl import tabulate
from tests.latent.made import GRID, MATERIALS, NEW, basis, material
from tests.measured.support import hemisphere
from tests.reflectances import Brushed, Glossy


def weighted(brdf: Brdf, mask: np.ndarray) -> np.ndarray:
    """Weighted f_r at some nodes from their angles, shape (nodes, 3)."""
    h, d, p = (index[mask] for index in np.indices(GRID.dimensions))
    theta_h = (h / 24) ** 2 * math.pi / 2
    theta_d, phi_d = d / 12 * math.pi / 2, p / 12 * math.pi
    wi, wo = np.empty((2, len(h), 3))
    for w, sign in ((wi, 1), (wo, -1)):
        x, y = sign * np.sin(theta_d) * np.cos(phi_d), sign * np.sin(theta_d) * np.sin(phi_d)
        z = np.cos(theta_d)
        w[:, 0] = np.cos(theta_h) * x + np.sin(theta_h) * z
        w[:, 1], w[:, 2] = y, np.cos(theta_h) * z - np.sin(theta_h) * x
    weight = np.maximum(wi[:, 2] * wo[:, 2], 0.001)[:, None]
    return brdf.eval(wi, wo) * weight


def median_relative(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mapping as Nielsen et al. have it: logarithms relative to the median, and its log."""
    reference = np.log(np.median(columns, axis=0) + 0.001)
    return np.log(columns + 0.001) - reference, reference


def whole_basis(separate: bool = False) -> PcaBasis:
    """A basis of the least size from 5 in which every component has all its values."""
    for count in itertools.count(5):
        made = basis(count, separate)
        if separate and count % 3 == 0:
            return made
        if not separate and (is_luma(made)[-1] or np.bincount(made.uses)[-1] == 2):
            return made
    raise AssertionError


def is_luma(made: PcaBasis) -> np.ndarray:
    return np.abs(made.colors.sum(axis=1)) > 1.5


@pytest.mark.parametrize("separate", [False, True])
def test_reconstruction_is_that_of_a_dense_decomposition(separate):
    made = whole_basis(separate)
    mask = made.mask
    if separate:
        rows = np.concatenate([weighted(m(), mask).T for m in MATERIALS])
        new, size = weighted(NEW, mask).T, len(made.components)
    else:
        permutations = list(itertools.permutations(range(3)))
        whole = [weighted(m(), mask)[:, list(p)] for m in MATERIALS for p in permutations]
        rows = np.stack([f.T.reshape(-1) for f in whole])
        new, size = weighted(NEW, mask).T.reshape(1, -1), made.code_dim
    mapped, reference = median_relative(rows)
    mean = mapped.mean(axis=0)
    _, _, vectors = np.linalg.svd(mapped - mean, full_matrices=False)
    kept = vectors[:size]
    relative = np.log(new + 0.001) - reference - mean
    expected = (relative @ kept.T @ kept + mean + reference).reshape(3, -1).T
    found = made.logarithms(made.encode(NEW, refine=False))
    np.testing.assert_allclose(found, expected, atol=2e-3)


def test_components_are_orthonormal_and_codes_have_unit_variance():
    made = whole_basis()
    assert 0 < is_luma(made).sum() < made.code_dim
    gram = (made.components @ made.components.T)[np.ix_(made.uses, made.uses)]
    products = gram * (made.colors @ made.colors.T)
    np.testing.assert_allclose(products, np.eye(made.code_dim), atol=1e-5)
    codes = np.array([made.encode(m(), refine=False) for m in MATERIALS])
    # Permuting channels turns the two values of a component into each other.
    power = np.bincount(made.uses, np.mean(codes**2, axis=0)) / np.bincount(made.uses)
    np.testing.assert_allclose(power, 1.0, atol=0.01)


def test_training_materials_come_back_with_all_values():
    count = 7 + 2 * 8
    made = PcaBasis.train(MATERIALS, PcaRecipe(count, GRID))
    for make in MATERIALS[:2]:
        decoded, truth = made.decode(made.encode(make(), refine=False)), tabulate(make(), GRID)
        assert decoded.mask.sum() == truth.mask.sum()
        known = truth.mask
        np.testing.assert_allclose(
            decoded.stored[:, known], truth.stored[:, known], rtol=0.02, atol=0.05
        )


def test_a_basis_knows_permuted_materials_as_well():
    made = whole_basis()
    turned = Ggx(
        diffuse=NEW.values["diffuse"][::-1],
        specular=NEW.values["specular"][::-1],
        roughness=NEW.values["roughness"],
    )
    one, other = (made.logarithms(made.encode(m, refine=False)) for m in (NEW, turned))
    np.testing.assert_allclose(one[:, ::-1], other, atol=1e-4)


def test_codes_of_partly_known_materials_use_what_is_known():
    made = basis(6)
    table = tabulate(NEW, GRID)
    holes = table.stored.copy()
    holes[:, np.random.default_rng(0).random(GRID.dimensions) < 0.3] = -1.0
    np.testing.assert_allclose(
        made.encode(MerlBrdf(holes), refine=False), made.encode(table, refine=False), atol=0.15
    )
    # Taken as zeros they would be far off.
    zeros = made.encode(MerlBrdf(np.maximum(holes, 0.0)), refine=False)
    assert np.abs(zeros - made.encode(table, refine=False)).max() > 1.0
    with pytest.raises(NacreError, match="known at no node"):
        made.encode(MerlBrdf(np.full_like(holes, -1.0)), refine=False)


@pytest.mark.parametrize("seed", [100, 101, 102])
def test_refined_codes_are_closest_in_what_pictures_show(seed):
    made, truth = basis(6), tabulate(material(seed), GRID)
    values, weight = made.values(truth)[0], np.nonzero(made.mask)[0] + 0.5
    cosine = node_cosines(GRID)[0][made.mask][:, None]

    def loss(code: np.ndarray) -> float:
        f = np.maximum(np.exp(made.logarithms(code)) - EPSILON, 0.0) / made.weights()[:, None]
        error = np.abs(np.log1p(30.0 * f * cosine) - np.log1p(30.0 * values * cosine))
        return float(np.average(error.mean(axis=1), weights=weight))

    code = made.encode(truth)
    np.testing.assert_array_equal(code, made.encode(truth))
    assert loss(code) < loss(made.encode(truth, refine=False))
    for step in 0.1 * np.concatenate([np.eye(6), -np.eye(6)]):
        assert loss(code + step) > loss(code)


def test_any_code_gives_finite_reflectance():
    made = basis(6)
    wi, wo = (hemisphere(np.random.default_rng(5), 500) for _ in range(2))
    for code in (np.zeros(6), np.full(6, 9e5), np.full(6, -9e5), np.eye(6)[0] * 50):
        f = made.decode(code).eval(wi, wo)
        assert np.isfinite(f).all()
        assert (f >= 0).all()
        assert f.max() <= 1.1e6 / EPSILON
    for wrong in (np.zeros(5), np.full(6, np.nan), np.full(6, 1e6), np.zeros((6, 1))):
        with pytest.raises(ValueError, match="6 values"):
            made.decode(wrong)


def test_sizes_are_stated():
    made, facts = basis(6), basis(6).decode(np.zeros(6)).describe()
    assert (facts["code dim"], facts["code bytes"]) == (6, 24)
    assert facts["basis bytes"] == made.nbytes > made.components.nbytes


def test_what_cannot_be_trained_on_is_refused():
    with pytest.raises(NacreError, match="two materials"):
        PcaBasis.train(MATERIALS[:1], PcaRecipe(1, GRID))
    with pytest.raises(NacreError, match="give 15 values of a code, not 20"):
        PcaBasis.train(MATERIALS[:2], PcaRecipe(20, GRID, separate=True))
    with pytest.raises(FormatError, match="isotropic"):
        PcaBasis.train([Brushed, partial(Glossy, 0.1, 0.1, 0.3)], PcaRecipe(1, GRID))
    nowhere = MerlBrdf(np.full((3, *GRID.dimensions), -1.0))
    with pytest.raises(NacreError, match="no node"):
        PcaBasis.train([MATERIALS[0], lambda: nowhere], PcaRecipe(1, GRID))


def alike(step: float) -> PcaBasis:
    """A basis of three grays that differ by no more than a multiple of `step`."""
    grays = [
        Ggx(diffuse=(0.3 + s,) * 3, specular=(0.1 + s,) * 3, roughness=0.3 + s / 2)
        for s in (0.0, step, 3.0 * step)
    ]
    return PcaBasis.train([partial(lambda brdf: brdf, g) for g in grays], PcaRecipe(2, GRID))


def test_codes_far_from_the_training_materials_are_refined():
    tight = alike(0.02)
    projected, code = tight.encode(NEW, refine=False), tight.encode(NEW)
    assert np.abs(projected).max() > 30.0
    assert not np.array_equal(code, projected)


def test_materials_too_unlike_those_of_the_basis_are_refused():
    with pytest.raises(NacreError, match="too unlike the materials of the basis"):
        alike(1e-4).encode(NEW, refine=False)
