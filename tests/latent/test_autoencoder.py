"""The autoencoder: networks that can be compared, the loss, and the training."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.latent import Autoencoder
from nacre.latent import distillation as distillation_module
from nacre.latent.directions import isotropic_inputs, isotropic_values
from nacre.latent.distillation import Distillation
from nacre.latent.weights import network_layers, permuted, sensitivity
from nacre.neural import NeuralBrdf
from nacre.numerics.mlp import Layer, forward
from tests.latent.made import MATERIALS, NEW, random_autoencoder, stop_at
from tests.reflectances import Brushed

pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.latent import AutoencoderRecipe, autoencoder_training, descent
from nacre.latent.autoencoder_training import lit_pixels, torch

RECIPE = AutoencoderRecipe(
    code_dim=4, width=32, mixtures=6, steps=200, networks=16, pixels=64, predictors=False
)
PIXELS = [part[:400] for part in lit_pixels()]


@pytest.fixture(scope="module")
def distillation() -> Distillation:
    return Distillation(0)


@pytest.fixture(scope="module")
def rows(distillation) -> list[np.ndarray]:
    return [isotropic_values(make(), distillation.wi, distillation.wo) for make in MATERIALS]


@pytest.fixture(scope="module")
def trained() -> Autoencoder:
    return Autoencoder.train(MATERIALS, RECIPE)


def network(weights: np.ndarray) -> NeuralBrdf:
    return NeuralBrdf(network_layers(weights))


def metric(weights: np.ndarray) -> np.ndarray:
    return sensitivity(weights, *(part[:60] for part in PIXELS))


def logarithms(f_r: np.ndarray, wi: np.ndarray) -> np.ndarray:
    return np.log1p(30.0 * f_r * wi[:, 2:])


def test_networks_are_those_of_materials_and_begin_at_one(distillation, rows):
    common = distillation.common(rows)
    f = network(common).eval(distillation.wi, distillation.wo)
    np.testing.assert_allclose(f, np.repeat(f[:, :1], 3, axis=1), rtol=1e-5)
    gray = np.expm1(np.mean([np.log1p(row).mean(axis=1) for row in rows], axis=0))
    assert np.abs(f[:, 0] - gray).mean() < 0.1 * gray.mean()
    one, other = (distillation.weights(common, row) for row in rows[:2])
    wi, wo = distillation.wi, distillation.wo
    near = logarithms(network(one).eval(wi, wo), wi) - logarithms(rows[0], wi)
    assert np.abs(near).mean() < 0.05
    # Neurons are in the same places: those of another material are much alike.
    assert np.corrcoef(one, other)[0, 1] > 0.7


def test_a_permuted_network_is_one_of_permuted_colors(distillation, rows):
    weights = distillation.weights(distillation.common(rows), rows[0])
    wi, wo = distillation.wi[:500], distillation.wo[:500]
    order = [2, 0, 1]
    f, g = (network(w).eval(wi, wo) for w in (weights, permuted(weights[None], order)[0]))
    np.testing.assert_allclose(g, f[:, order], rtol=1e-5)
    assert not np.allclose(f, g, rtol=1e-2)


def test_mixtures_of_one_material_are_that_material_brighter_or_darker(rows):
    gray = np.clip(rows[0][:, :1], 0.01, 10.0).repeat(3, axis=1)
    unknown = np.arange(len(gray)) % 7 == 0
    other = np.where(unknown[:, None], -1.0, gray).astype(np.float32)
    many = [gray, other, gray, gray, gray]
    mean = distillation_module._mean_logarithm(many)
    np.testing.assert_allclose(mean, np.log(gray[:, :1]), rtol=1e-4, atol=1e-4)
    missing = []
    for seed in range(20):
        mixed = distillation_module._mixture([gray] * 5, mean, (seed,))
        ratios = mixed / gray
        np.testing.assert_allclose(ratios, np.broadcast_to(ratios[:1, :1], gray.shape), rtol=1e-3)
        assert 0.5 < ratios[0, 0] < 2.0
        found = distillation_module._mixture(many, mean, (seed,))
        missing.append((found < 0.0).all(axis=1))
        np.testing.assert_allclose(found[~missing[-1]], mixed[~missing[-1]], rtol=1e-4)
    assert {tuple(np.unique(unknown[m])) for m in missing if m.any()} == {(True,)}
    assert any(m.any() for m in missing)


def test_mixtures_are_as_varied_as_materials_and_beyond_them(rows):
    mean = distillation_module._mean_logarithm(rows)
    logs = np.log(np.maximum(rows, 1e-4)) - mean
    mixed = [distillation_module._mixture(rows, mean, (seed,)) for seed in range(40)]
    spread = np.std(np.log(mixed) - mean)
    assert 0.4 * logs.std() < spread < 1.2 * logs.std()
    assert max(m.mean() for m in mixed) > 0.9 * max(r.mean() for r in rows)


def test_the_metric_says_how_far_changes_of_weights_move_a_network(distillation, rows):
    weights = distillation.weights(distillation.common(rows), rows[0]).astype(np.float64)
    wi, wo = (part[:200] for part in PIXELS)
    inputs = isotropic_inputs(wi, wo, "paper").astype(np.float64)

    def seen(flat: np.ndarray) -> np.ndarray:
        arrays = np.split(flat, np.cumsum([126, 21, 441, 21, 63]))
        layers = [
            Layer(m.reshape(-1, b.size), b) for m, b in zip(arrays[::2], arrays[1::2], strict=True)
        ]
        return logarithms(np.expm1(forward(inputs, layers)), wi)

    found = sensitivity(weights, wi, wo)
    change = np.random.default_rng(3).normal(0.0, 1e-5, 675)
    orders = itertools.permutations(range(3))
    moved = [seen(weights + permuted(change[None], o)[0]) - seen(weights) for o in orders]
    assert change @ found @ change == pytest.approx(np.square(moved).mean(), rel=0.02)


def test_the_loss_compares_pictures_of_networks(rows):
    weights = np.stack([random_autoencoder().weights(c[None])[0] for c in np.eye(6)[:3]])
    training = autoencoder_training._Training(
        weights.astype(np.float32), np.eye(675), PIXELS, RECIPE
    )
    wi, wo = PIXELS
    seen = training._pictures(training._networks[:, 0], torch.arange(len(wi)))
    f = np.stack([network(w).eval(wi, wo) for w in weights])
    expected = np.maximum(math.pi * f * wi[:, 2:], 1e-12) ** (1.0 / 2.2)
    np.testing.assert_allclose(seen.numpy(), expected, rtol=1e-3, atol=1e-4)


def test_the_formula_is_that_of_the_training():
    random = np.random.default_rng(1)
    weights = random.normal(0.0, 0.3, (5, 675)).astype(np.float32)
    training = autoencoder_training._Training(weights, metric(weights), PIXELS, RECIPE)
    made = training.autoencoder(weights[0], {})
    codes = made.codes(np.concatenate([permuted(weights, p) for p in ([0, 1, 2], [1, 2, 0])]))
    every = made.codes(training._networks.reshape(-1, 675).numpy())
    np.testing.assert_allclose(every.mean(axis=0), 0.0, atol=1e-4)
    np.testing.assert_allclose(every.std(axis=0), 1.0, rtol=1e-3)
    expected = training._decoded(training._codes(training._seen[:, 0])).detach().numpy()
    np.testing.assert_allclose(made.weights(codes[:5]), expected, rtol=1e-3, atol=1e-4)


def test_training_brings_decoded_networks_closer(trained):
    losses = []
    short = AutoencoderRecipe(**{**vars(RECIPE), "steps": 1})
    Autoencoder.train(MATERIALS, short, progress=lambda *step: losses.append(step))
    assert losses[-1][:3] == ("training", 1, 1)
    assert trained.metadata["loss"] < 0.2 * float(losses[-1][3].removeprefix("loss "))
    assert trained.metadata["materials"] == [f"made {seed}" for seed in range(8)]
    wi, wo = PIXELS
    known = MATERIALS[0]()
    f = trained.decode(trained.encode(known, refine=False)).eval(wi, wo)
    assert np.abs(logarithms(f, wi) - logarithms(known.eval(wi, wo), wi)).mean() < 0.2


@pytest.mark.slow
def test_the_same_seed_gives_the_same_and_another_does_not(trained):
    again = Autoencoder.train(MATERIALS, RECIPE)
    np.testing.assert_array_equal(again.network.weights, trained.network.weights)
    np.testing.assert_array_equal(
        again.encode(NEW, refine=False), trained.encode(NEW, refine=False)
    )
    few = {**vars(RECIPE), "steps": 3, "seed": 1}
    other = Autoencoder.train(MATERIALS, AutoencoderRecipe(**few))
    assert not np.array_equal(other.common, trained.common)


@pytest.mark.slow
def test_stopped_training_goes_on_as_if_never_stopped(trained, tmp_path, monkeypatch):
    monkeypatch.setattr(descent, "SAVE_EVERY", 0.0)
    state = tmp_path / "state"
    with pytest.raises(KeyboardInterrupt):
        Autoencoder.train(MATERIALS, RECIPE, checkpoint=state, progress=stop_at(100))
    with pytest.raises(NacreError, match="belongs to another run"):
        Autoencoder.train(MATERIALS[1:], RECIPE, checkpoint=state)
    whole, seen = state.read_bytes(), []
    resumed = Autoencoder.train(
        MATERIALS, RECIPE, checkpoint=state, progress=lambda *step: seen.append(step)
    )
    assert min(done for stage, done, *_ in seen if stage == "training") > 80
    np.testing.assert_array_equal(resumed.network.weights, trained.network.weights)
    state.write_bytes(whole[:-100])
    with pytest.raises(NacreError, match="cannot be read, remove it"):
        Autoencoder.train(MATERIALS, RECIPE, checkpoint=state)


def test_what_cannot_be_trained_on_is_refused():
    with pytest.raises(NacreError, match="two materials"):
        Autoencoder.train(MATERIALS[:1], RECIPE)
    with pytest.raises(FormatError, match="isotropic"):
        Autoencoder.train([*MATERIALS, Brushed], RECIPE)
    with pytest.raises(FormatError, match="isotropic"):
        random_autoencoder().encode(Brushed())
