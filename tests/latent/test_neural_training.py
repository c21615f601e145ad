"""Training of a neural basis: it learns, it goes on, it says what is wrong."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.latent import BasisRecipe, NeuralBasis
from nacre.latent.directions import shared_directions
from nacre.measured import MerlBrdf
from nacre.measured.merl import tabulate
from tests.latent.made import GRID, MATERIALS, NEW, stop_at
from tests.reflectances import Brushed

pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.latent import descent
from nacre.runtime import device

RECIPE = BasisRecipe(
    predictors=False, code_dim=6, hidden=(24, 24), steps=300, directions=4096, batch=128
)
WI, WO = shared_directions(3000, 11)


@pytest.fixture(scope="module")
def trained() -> NeuralBasis:
    return NeuralBasis.train(MATERIALS, RECIPE)


def error(basis: NeuralBasis) -> float:
    """How far the material nobody trained on is from its code, as pictures count it."""
    decoded = basis.decode(basis.encode(NEW))
    seen = (np.log1p(30.0 * f.eval(WI, WO) * WI[:, 2:]) for f in (decoded, NEW))
    return float(np.abs(np.subtract(*seen)).mean())


def test_training_lowers_the_loss_and_brings_new_materials_closer(trained):
    losses = []
    short = BasisRecipe(
        predictors=False, code_dim=6, hidden=(24, 24), steps=10, directions=4096, batch=128
    )
    NeuralBasis.train(MATERIALS, short, progress=lambda *step: losses.append(step))
    assert losses[-1][:3] == ("training", 10, 10)
    assert trained.metadata["loss"] < 0.2 * float(losses[-1][3].removeprefix("loss "))
    assert error(trained) < 0.1
    assert trained.metadata["materials"] == [f"made {seed}" for seed in range(8)]


def test_the_same_seed_gives_the_same_basis_and_another_does_not(trained):
    np.testing.assert_array_equal(NeuralBasis.train(MATERIALS, RECIPE).functions, trained.functions)
    other = BasisRecipe(
        predictors=False, code_dim=6, hidden=(24, 24), steps=20, directions=4096, batch=128, seed=1
    )
    assert not np.array_equal(NeuralBasis.train(MATERIALS, other).functions, trained.functions)


def test_codes_of_the_training_materials_have_mean_0_and_covariance_1(trained):
    codes = trained.examples.astype(float)
    assert codes.shape == (8, 6)
    luma, pairs = codes[:, : trained.luma], codes[:, trained.luma :]
    np.testing.assert_allclose(luma.mean(axis=0), 0.0, atol=1e-4)
    np.testing.assert_allclose(np.cov(luma.T, bias=True), np.eye(trained.luma), atol=1e-3)
    assert (pairs**2).mean() == pytest.approx(1.0, abs=1e-3)


def test_examples_are_codes_of_the_training_materials(trained):
    for code, make in zip(trained.examples, MATERIALS, strict=True):
        seen = (np.log1p(30.0 * f.eval(WI, WO) * WI[:, 2:]) for f in (trained.decode(code), make()))
        assert np.abs(np.subtract(*seen)).mean() < 0.15


def test_stopped_training_goes_on_as_if_never_stopped(trained, tmp_path, monkeypatch):
    monkeypatch.setattr(descent, "SAVE_EVERY", 0.0)
    state = tmp_path / "state"
    with pytest.raises(KeyboardInterrupt):
        NeuralBasis.train(MATERIALS, RECIPE, checkpoint=state, progress=stop_at(100))
    assert state.exists()
    seen = []
    resumed = NeuralBasis.train(
        MATERIALS, RECIPE, checkpoint=state, progress=lambda *step: seen.append(step)
    )
    assert min(done for stage, done, *_ in seen if stage == "training") > 80
    np.testing.assert_array_equal(resumed.functions, trained.functions)
    assert list(tmp_path.iterdir()) == [state]
    again = NeuralBasis.train(MATERIALS, RECIPE, checkpoint=state)
    np.testing.assert_array_equal(again.functions, trained.functions)


def test_a_checkpoint_of_another_training_or_a_damaged_one_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(descent, "SAVE_EVERY", 0.0)
    state = tmp_path / "state"
    with pytest.raises(KeyboardInterrupt):
        NeuralBasis.train(MATERIALS, RECIPE, checkpoint=state, progress=stop_at(10))
    with pytest.raises(NacreError, match="belongs to another run"):
        NeuralBasis.train(MATERIALS[1:], RECIPE, checkpoint=state)
    for content in (state.read_bytes()[:-100], b"", b"nothing"):
        state.write_bytes(content)
        with pytest.raises(NacreError, match="cannot be read, remove it"):
            NeuralBasis.train(MATERIALS, RECIPE, checkpoint=state)


def test_threads_come_back_whatever_happens():
    seen, count = [], descent.torch.get_num_threads

    @device.one_thread()
    def stopped() -> None:
        seen.append(count())
        raise KeyboardInterrupt

    before = count()
    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert (seen, count()) == ([1], before)


def test_nodes_that_are_not_known_are_not_trained_on(tmp_path: Path):
    recipe = BasisRecipe(
        predictors=False, code_dim=3, hidden=(16,), steps=60, directions=2048, batch=128
    )
    tables = [tabulate(make(), GRID) for make in MATERIALS[:3]]
    hole = np.zeros(GRID.dimensions, bool)
    hole[8:] = True
    damaged = [MerlBrdf(np.where(hole, -1.0, table.stored)) for table in tables]
    made = NeuralBasis.train([partial(lambda t: t, table) for table in damaged], recipe)
    # As zeros, that much of a table would make its mean black.
    f = made.decode(np.zeros(made.code_dim)).eval(WI, WO)
    assert np.median(f) > 0.03


def test_what_cannot_be_trained_on_is_refused():
    with pytest.raises(NacreError, match="two materials"):
        NeuralBasis.train(MATERIALS[:1], RECIPE)
    with pytest.raises(FormatError, match="isotropic"):
        NeuralBasis.train([*MATERIALS, Brushed], RECIPE)
    nowhere = MerlBrdf(np.full((3, *GRID.dimensions), -1.0))
    with pytest.raises(NacreError, match="known at none"):
        NeuralBasis.train([*MATERIALS, lambda: nowhere], RECIPE)


@pytest.mark.parametrize(("values", "pairs"), [(1, 0), (2, 0), (3, 1), (8, 1), (16, 2), (32, 5)])
def test_colors_get_their_part_of_a_code(values, pairs):
    recipe = BasisRecipe(
        predictors=False, code_dim=values, hidden=(4,), steps=1, directions=64, batch=16
    )
    assert recipe.pairs == pairs
    made = NeuralBasis.train(MATERIALS, recipe)
    assert made.code_dim == values
    assert made.luma == values - 2 * pairs
