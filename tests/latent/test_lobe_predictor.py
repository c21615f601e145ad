"""Lobes predicted from codes: valid whatever the code, kept in the basis, used by its materials."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.latent import Autoencoder, LobePredictor, NeuralBasis
from nacre.latent.file import load_basis, load_code, save_basis, save_code
from nacre.sampling import BlinnPhongMixture, GgxMixture
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from tests.latent.made import predictor, random_autoencoder, random_basis

KINDS = {"blinn-phong": BlinnPhongMixture, "ggx": GgxMixture, "mixture": GgxMixture}


def predicting() -> NeuralBasis:
    """A basis with a predictor of every kind."""
    return replace(random_basis(), predictors={name: predictor(name) for name in PARAMETRIZATIONS})


@pytest.mark.parametrize("family", PARAMETRIZATIONS)
@pytest.mark.parametrize("scale", [0.1, 100.0])
def test_any_code_gives_valid_lobes(family: str, scale: float) -> None:
    predict = predictor(family, scale=scale)
    random = np.random.default_rng(0)
    for length in (0.0, 1.0, 1e3, 9e5):
        for code in length * random.normal(size=(10, 6)):
            assert isinstance(predict(code), KINDS[family])  # which refuses what is out of bounds


def test_codes_that_differ_get_lobes_that_differ() -> None:
    predict = predictor("mixture")
    assert predict(np.ones(6)) == predict(np.ones(6)) != predict(np.zeros(6))


@pytest.mark.parametrize(
    ("family", "change", "words"),
    [
        ("magic", lambda layers: layers, "unknown sampler 'magic'"),
        ("mixture", lambda layers: layers, "takes 30 parameters"),
        ("ggx", lambda layers: layers[::-1], "do not chain"),
        ("ggx", lambda layers: [], "at least one layer"),
    ],
)
def test_what_is_no_predictor_is_refused(family, change, words) -> None:
    with pytest.raises(ValueError, match=words):
        LobePredictor(family, change(predictor("ggx").layers))


def test_a_predictor_for_other_codes_is_refused() -> None:
    for wrong in ({"ggx": predictor("ggx", 7)}, {"ggx": predictor("mixture")}):
        with pytest.raises(ValueError, match="is not for codes of 6 values"):
            replace(random_basis(), predictors=wrong)


def test_materials_sample_by_what_is_predicted() -> None:
    basis, code = predicting(), np.linspace(-1.0, 1.0, 6)
    decoded = basis.decode(code)
    assert decoded.sampler == basis.predictors["mixture"](code)
    assert decoded.describe()["sampler"] == f"predicted: {decoded.sampler}"
    plain = random_basis().decode(code)
    assert "sampler" not in plain.describe()
    assert plain.sampler != decoded.sampler
    u = np.random.default_rng(0).random((500, 3))
    wo = np.array([0.6, 0.0, 0.8])
    wi, pdf = decoded.sample(wo, u)
    up = pdf > 0
    np.testing.assert_allclose(decoded.pdf(wi[up], wo), pdf[up], rtol=1e-4)


def test_predictors_are_kept_with_the_basis(tmp_path: Path) -> None:
    path, code = tmp_path / "basis.safetensors", np.linspace(-1.0, 1.0, 6)
    before = predicting()
    save_basis(before, path)
    after = load_basis(path)
    assert isinstance(after, NeuralBasis)
    assert sorted(after.predictors) == sorted(PARAMETRIZATIONS)
    for name in PARAMETRIZATIONS:
        assert after.predictors[name](code) == before.predictors[name](code)
    save_basis(after, tmp_path / "two.safetensors")
    assert (tmp_path / "two.safetensors").read_bytes() == path.read_bytes()


def test_codes_stay_with_a_basis_that_got_predictors(tmp_path: Path) -> None:
    assert predicting().fingerprint() == random_basis().fingerprint()
    everything = predicting().fingerprint(predictors=True)
    assert everything != predicting().fingerprint()
    save_code(random_basis().decode(np.ones(6)), tmp_path / "x.json")
    np.testing.assert_array_equal(load_code(tmp_path / "x.json", predicting()).code, 1.0)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ({"magic": 2}, "unknown sampler 'magic'|is missing"),
        ({"ggx": 3}, "is missing"),
        ({"ggx": 0}, "at least one layer"),
        ({"ggx": "x"}, "ggx is not a whole number"),
        ([1], "predictors is not an object"),
        (None, "predictors is not an object"),
    ],
)
def test_a_damaged_predictor_is_refused(tmp_path: Path, monkeypatch, header, words) -> None:
    pack = NeuralBasis.pack

    def damaged(basis):
        own, tensors = pack(basis)
        return own | {"predictors": header}, tensors

    path = tmp_path / "basis.safetensors"
    monkeypatch.setattr(NeuralBasis, "pack", damaged)
    save_basis(predicting(), path)
    with pytest.raises(FormatError, match=words):
        load_basis(path)


def test_an_autoencoder_keeps_its_predictors_and_what_they_are_trained_on(tmp_path: Path) -> None:
    plain = random_autoencoder()
    examples = np.random.default_rng(1).normal(size=(3, 6, 6)).astype(np.float32)
    learned = {"ggx by labels": predictor("ggx", seed=7), "mixture": predictor("mixture")}
    before = plain.replaced(examples=examples, predictors=learned)
    save_basis(before, tmp_path / "basis.safetensors")
    after = load_basis(tmp_path / "basis.safetensors")
    assert isinstance(after, Autoencoder)
    np.testing.assert_array_equal(after.orders(), examples)
    code = np.linspace(-1.0, 1.0, 6)
    for name, predict in learned.items():
        assert after.predictors[name](code) == predict(code)
    assert after.fingerprint() == plain.replaced(examples=examples).fingerprint()
    assert after.nbytes > plain.nbytes
    assert after.describe()["predicts lobes"] == "ggx by labels, mixture"
    # What earlier versions wrote holds neither, and their codes stay valid.
    save_basis(plain, tmp_path / "old.safetensors")
    old = load_basis(tmp_path / "old.safetensors")
    assert isinstance(old, Autoencoder)
    assert old.orders().shape == (0, 6, 6)
    assert old.predictors == {}
    assert set(old.pack()[0]) == {"seed", "epochs"}
    assert set(old.pack()[1]) == {
        "common",
        *(f"{x}_{part}" for x in old.LAYERS for part in ("weights", "biases")),
    }


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"examples": np.zeros((2, 6, 7), np.float32)}, "no codes of 6 values"),
        ({"examples": np.zeros((2, 5, 6), np.float32)}, "six orders"),
        ({"predictors": {"ggx": predictor("mixture")}}, "is not for codes of 6 values"),
        ({"predictors": {"ggx by labels": predictor("ggx", 7)}}, "is not for codes of 6 values"),
        ({"predictors": {"ggx by magic": predictor("ggx")}}, "is not for codes of 6 values"),
    ],
)
def test_an_autoencoder_refuses_what_is_for_other_codes(change, words) -> None:
    with pytest.raises(ValueError, match=words):
        random_autoencoder().replaced(**change)
