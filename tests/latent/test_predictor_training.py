"""Training of predictors: what they predict samples codes they have not seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.errors import NacreError
from nacre.geometry import split
from nacre.latent import LobePredictor, PredictorRecipe
from nacre.sampling import fit_blinn_phong, fit_lobes
from nacre.sampling.moment import second_moment
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from tests.latent.made import random_basis

pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.latent import train_predictors, with_predictors

BASIS = replace(random_basis(), functions=3.0 * random_basis().functions)
"""Of contrasts that are worth sampling."""
RECIPE = PredictorRecipe(hidden=24, codes=256, sets=4, lights=64, steps=250)
CODES = np.random.default_rng(4).normal(size=(12, 6))
NEW = np.random.default_rng(8).normal(size=(4, 6))


@pytest.fixture(scope="module")
def predictors() -> dict[str, LobePredictor]:
    return train_predictors(BASIS, CODES, RECIPE)


def moment(brdf: Brdf, sampler: Sampler) -> float:
    seen = second_moment(brdf, 5)
    return float((seen.weights / sampler.pdf_components(split(seen.wi), split(seen.wo))).sum())


def logarithm(sample: Callable[[np.ndarray, Brdf], Sampler]) -> float:
    """Mean logarithm of the second moments of new codes."""
    brdfs = [BASIS.decode(code) for code in NEW]
    pairs = zip(brdfs, NEW, strict=True)
    return float(np.mean([np.log(moment(brdf, sample(code, brdf))) for brdf, code in pairs]))


@pytest.mark.parametrize("family", PARAMETRIZATIONS)
def test_predicted_lobes_sample_new_codes(predictors, family: str) -> None:
    cosine = logarithm(lambda code, brdf: CosineSampler())
    predicted = logarithm(lambda code, brdf: predictors[family](code))
    assert predicted < cosine
    if family == "mixture":
        searched = logarithm(lambda code, brdf: fit_lobes(brdf))
        assert predicted - searched < 0.5 * (cosine - searched)
    else:
        searched = logarithm(lambda code, brdf: fit_blinn_phong(brdf))
        assert predicted < searched + 0.05


def test_the_same_seed_gives_the_same_predictor_and_progress_is_reported() -> None:
    short = PredictorRecipe(hidden=8, codes=32, sets=2, lights=16, steps=50)
    seen = []
    one, other = (
        train_predictors(random_basis(), CODES, short, lambda *step: seen.append(step))
        for _ in range(2)
    )
    for name in PARAMETRIZATIONS:
        for a, b in zip(one[name].layers, other[name].layers, strict=True):
            np.testing.assert_array_equal(a.weights, b.weights)
    assert [step[:3] for step in seen[:2]] == [("decoding", 1, 2), ("decoding", 2, 2)]
    assert seen[-1][:3] == ("predicting", 150, 150)
    assert "second moment" in seen[-1][3]


def test_a_basis_gets_predictors_from_its_examples() -> None:
    short = PredictorRecipe(hidden=8, codes=32, sets=2, lights=16, steps=5)
    basis = random_basis()
    made = with_predictors(basis, short)
    assert sorted(made.predictors) == sorted(PARAMETRIZATIONS)
    assert made.functions is basis.functions
    with pytest.raises(NacreError, match="with examples"):
        with_predictors(replace(basis, examples=basis.examples[:0]), short)


def test_codes_that_are_not_finite_end_in_a_clear_error() -> None:
    short = PredictorRecipe(hidden=8, codes=32, sets=2, lights=16, steps=20)
    with pytest.raises(NacreError, match="not finite"):
        train_predictors(random_basis(), np.full((2, 6), np.nan), short)
