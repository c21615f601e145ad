"""Training of predictors: what they predict samples codes they have not seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.analytic.labels import fitted_lobes, highlight_share, model_lobes
from nacre.analytic.phong import BlinnPhong
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.errors import NacreError
from nacre.geometry import split
from nacre.latent import LobePredictor, PredictorRecipe
from nacre.sampling import BlinnPhongMixture, UniformSampler, fit_blinn_phong, fit_lobes
from nacre.sampling.moment import second_moment
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from tests.latent.made import random_autoencoder, random_basis

pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.latent import train_predictors, with_labels, with_predictors

BASIS = replace(random_basis(), functions=3.0 * random_basis().functions)
"""Of contrasts that are worth sampling."""
RECIPE = PredictorRecipe(hidden=24, codes=256, sets=4, lights=64, steps=250)
CODES = np.random.default_rng(4).normal(size=(12, 6))
NEW = np.random.default_rng(8).normal(size=(4, 6))
GREY = {"diffuse": (0.2,) * 3, "specular": (0.1,) * 3}


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


def examples() -> np.ndarray:
    return np.random.default_rng(6).normal(size=(4, 6, 6)).astype(np.float32)


LABELS = {
    "blinn-phong": [BlinnPhongMixture(0.1 + 0.2 * k, 10.0 * 8.0**k) for k in range(4)],
    "ggx": [model_lobes(Ggx(**GREY, roughness=0.02 * 3.0**k)) for k in range(4)],
}


def test_an_autoencoder_learns_lobes_from_labels() -> None:
    basis = random_autoencoder().replaced(examples=examples())
    seen = []
    recipe = PredictorRecipe(hidden=64, steps=600)
    found = with_labels(basis, LABELS, recipe, lambda *step: seen.append(step))
    assert list(found.predictors) == ["blinn-phong by labels", "ggx by labels"]
    assert seen[-1][:3] == ("labels", 600, 600)
    for name, labels in LABELS.items():
        predict = found.predictors[f"{name} by labels"]
        for codes, label in zip(basis.orders(), labels, strict=True):
            for code in codes:
                near = predict.parametrization.places(predict(code))
                np.testing.assert_allclose(near, predict.parametrization.places(label), atol=0.08)


def test_labels_that_do_not_fit_are_refused() -> None:
    basis = random_autoencoder().replaced(examples=examples())
    short = PredictorRecipe(hidden=8, steps=5)
    some = {"ggx": [*LABELS["ggx"][:2], None, None]}
    assert "ggx by labels" in with_labels(basis, some, short).predictors
    with pytest.raises(NacreError, match="no labels 'ggx'"):
        with_labels(basis, {"ggx": [None] * 4}, short)
    with pytest.raises(ValueError, match="3 labels 'ggx' for 4"):
        with_labels(basis, {"ggx": LABELS["ggx"][:3]}, short)
    for name in ("ggx", "mixture", "blinn-phong"):
        with pytest.raises(ValueError, match="lobes of type UniformSampler cannot be labels"):
            with_labels(basis, {name: [UniformSampler()] * 4}, short)
    with pytest.raises(NacreError, match="with examples"):
        with_labels(random_autoencoder(), LABELS, short)


def test_an_autoencoder_learns_lobes_from_the_variance() -> None:
    basis = random_autoencoder().replaced(examples=examples())
    short = PredictorRecipe(hidden=16, codes=64, sets=2, lights=64, steps=60)
    found = with_predictors(with_labels(basis, LABELS, short), short)
    assert set(found.predictors) == {*PARAMETRIZATIONS, *(f"{name} by labels" for name in LABELS)}
    brdfs = [found.decode(code) for code in examples()[:, 0]]
    by_variance, by_labels = (
        sum(np.log(moment(brdf, found.predictors[name](brdf.code))) for brdf in brdfs)
        for name in ("ggx", "ggx by labels")
    )
    assert by_variance < by_labels


def test_what_codes_reflect_is_that_of_what_they_decode_into() -> None:
    wi, wo = np.random.default_rng(1).normal(size=(2, 40, 3))
    for w in (wi, wo):
        w[:, 2] = np.abs(w[:, 2]) + 0.1
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    for basis in (random_basis(), random_autoencoder()):
        codes = np.random.default_rng(2).normal(scale=3.0, size=(3, 6))
        values = basis.reflectances(codes, wi, wo)
        for code, found in zip(codes, values, strict=True):
            expected = basis.decode(code).eval(wi.astype(np.float32), wo.astype(np.float32))
            np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-5)


def test_lobes_of_a_model_have_its_width_and_its_share_of_the_albedo() -> None:
    sharp = BlinnPhong(diffuse=(0.2,) * 3, specular=(0.1,) * 3, exponent=2000.0)
    exact = 4.0 * 0.1 * 2000.0 / 2004.0  # ks 4 n / (n + 4), in closed form
    assert highlight_share(sharp) == pytest.approx(exact / (exact + 0.2), rel=1e-3)
    lobes = model_lobes(sharp)
    assert (lobes.exponent, lobes.specular) == (2000.0, pytest.approx(highlight_share(sharp)))
    facets = Ggx(**GREY, roughness=0.1)
    found = fitted_lobes(facets, "ggx").lobes[0]
    assert found.roughness[0] == pytest.approx(0.1, rel=0.02)
    assert found.fraction[0] == pytest.approx(highlight_share(facets), rel=0.02)
    black = BlinnPhong(diffuse=(0.0,) * 3, specular=(0.0,) * 3, exponent=1.0)
    assert highlight_share(black) == 0.0
