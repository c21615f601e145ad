"""Training of a hypernetwork: it comes close to its basis, it goes on, it says what is wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.latent import Hypernetwork, NeuralBasis
from nacre.latent.directions import isotropic_inputs, shared_directions
from nacre.neural.inputs import ENHANCED
from tests.latent.made import random_basis, stop_at

pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.latent import HypernetworkRecipe, descent, hypernetwork_training
from nacre.latent.hypernetwork_training import torch

RECIPE = HypernetworkRecipe(width=32, steps=300, codes=48, directions=64)
WI, WO = shared_directions(3000, 11)


def train(basis: NeuralBasis, recipe: HypernetworkRecipe = RECIPE, **options: Any) -> Hypernetwork:
    return Hypernetwork.train([], recipe, base=basis, **options)


@pytest.fixture(scope="module")
def trained() -> Hypernetwork:
    return train(random_basis(), RECIPE)


def error(made: Hypernetwork, codes: np.ndarray) -> float:
    """How far networks are from what the basis has for the same codes, as pictures count it."""
    differences = []
    for code in codes:
        pair = made.decode(code), made.basis.decode(code)
        seen = (np.log1p(30.0 * f.eval(WI, WO) * WI[:, 2:]) for f in pair)
        differences.append(np.abs(np.subtract(*seen)).mean())
    return float(np.mean(differences))


def test_training_brings_networks_close_to_what_the_basis_has(trained):
    codes = np.random.default_rng(4).normal(size=(12, 6))
    short = train(random_basis(), HypernetworkRecipe(width=32, steps=5))
    assert error(trained, codes) < 0.3 * error(short, codes)
    assert trained.metadata["hypernetwork"]["steps"] == 300


def test_the_formula_is_that_of_the_training(trained):
    training = hypernetwork_training._Training(random_basis(), RECIPE)
    made = Hypernetwork(random_basis(), **training.layers())
    codes = np.random.default_rng(4).normal(size=(5, 6)).astype(np.float32)
    luma, pairs = torch.from_numpy(codes[:, :4]), torch.from_numpy(codes[:, 4:]).reshape(5, 1, 2)
    expected = training._weights(luma, pairs).detach().numpy()
    np.testing.assert_allclose(made.weights(codes), expected, rtol=1e-4, atol=1e-5)
    # What it is trained toward is the basis itself.
    weight = torch.full((3000, 1), 7.0)
    values = made.basis.values(isotropic_inputs(WI, WO, ENHANCED))
    goal = training._goal(luma, pairs, torch.from_numpy(values), weight)
    f = np.stack([made.basis.decode(code).eval(WI, WO) for code in codes])
    np.testing.assert_allclose(goal.numpy(), np.log1p(7.0 * f), rtol=1e-4, atol=1e-5)


def test_the_code_of_a_material_is_sought_in_the_network_itself(trained):
    truth = trained.decode(np.linspace(-1.0, 1.0, 6))
    code = trained.encode(truth)
    pair = trained.decode(code), truth
    near = np.subtract(*(np.log1p(30.0 * f.eval(WI, WO) * WI[:, 2:]) for f in pair))
    assert np.abs(near).mean() < 0.01
    np.testing.assert_array_equal(trained.encode(truth), code)


def test_the_same_seed_gives_the_same_and_another_does_not(trained):
    again = train(random_basis(), RECIPE)
    for name, layer in trained.layers.items():
        np.testing.assert_array_equal(again.layers[name].weights, layer.weights)
    few = {"width": 32, "steps": 5, "codes": 8}
    one, other = (train(random_basis(), HypernetworkRecipe(**few, seed=seed)) for seed in (0, 1))
    assert not np.array_equal(one.trunk.weights, other.trunk.weights)


def test_stopped_training_goes_on_as_if_never_stopped(trained, tmp_path, monkeypatch):
    monkeypatch.setattr(descent, "SAVE_EVERY", 0.0)
    state = tmp_path / "state"
    with pytest.raises(KeyboardInterrupt):
        train(random_basis(), RECIPE, checkpoint=state, progress=stop_at(100, "hypernetwork"))
    fewer = replace(random_basis(), examples=random_basis().examples[1:])
    for basis in (random_basis(2, 2), fewer):
        with pytest.raises(NacreError, match="belongs to another run"):
            train(basis, RECIPE, checkpoint=state)
    whole, seen = state.read_bytes(), []
    resumed = train(
        random_basis(), RECIPE, checkpoint=state, progress=lambda *step: seen.append(step)
    )
    assert min(done for stage, done, *_ in seen if stage == "hypernetwork") > 80
    for name, layer in trained.layers.items():
        np.testing.assert_array_equal(resumed.layers[name].weights, layer.weights)
    state.write_bytes(whole[:-100])
    with pytest.raises(NacreError, match="cannot be read, remove it"):
        train(random_basis(), RECIPE, checkpoint=state)


def test_a_basis_without_examples_is_refused():
    with pytest.raises(NacreError, match="with examples"):
        train(replace(random_basis(), examples=random_basis().examples[:0]))
