"""Settings of trainings, and how networks begin."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")
import torch

from nacre.textures.codecs.networks import (
    TrainingRecipe,
    UnifiedNetwork,
    UnifiedSettings,
    Whitening,
)
from nacre.textures.codecs.networks.mlp import initial
from nacre.textures.codecs.networks.recipe import optimizers


def test_the_reference_recipe_is_that_of_the_paper():
    recipe = TrainingRecipe.named("reference")
    assert (recipe.optimizer, recipe.learning_rate, recipe.batch) == ("sgd", 0.2, 10)
    assert (recipe.texels, recipe.epochs, recipe.loss) == (100, 1000, "l1")
    assert (recipe.encoder_fraction, recipe.permute) == (0.2, True)
    assert recipe.encoder_directions is recipe.loss_directions is None
    assert {recipe.rate(done) for done in (0.0, 0.3, 1.0)} == {0.2}


def test_the_rate_rises_and_falls():
    recipe = TrainingRecipe(learning_rate=3.0, warm_up=0.1)
    assert recipe.rate(0.0) == 0.0
    assert recipe.rate(0.05) == pytest.approx(1.5)
    assert recipe.rate(0.1) == pytest.approx(3.0)
    assert recipe.rate(0.55) == pytest.approx(1.5)
    assert recipe.rate(1.0) == recipe.rate(1.2) == pytest.approx(0.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"epochs": 0},
        {"batch": -1},
        {"encoder_directions": -5},
        {"encoder_fraction": 0.0},
        {"held_out": 1.0},
        {"learning_rate": math.nan},
        {"optimizer": "newton"},
        {"loss": "l3"},
        {"precision": "half"},
        {"variance": "none"},
        {"patience": -1},
    ],
)
def test_settings_that_no_training_has_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        TrainingRecipe(**wrong)
    with pytest.raises(ValueError, match="recipe must be one of reference, default"):
        TrainingRecipe.named("slow")


def test_layers_begin_as_those_of_pytorch_or_with_the_variance_of_he():
    shapes = {"x.weight": (300, 500), "x.bias": (500,), "y.weight": (70, 60, 9), "y.bias": (70,)}
    theirs = [torch.nn.Linear(300, 500), torch.nn.Conv1d(60, 70, 9)]
    arrays = initial(shapes, np.random.default_rng(0), "pytorch")
    scaled = initial(shapes, np.random.default_rng(0), "he")
    for name, layer, inputs in zip("xy", theirs, (300, 540), strict=True):
        weight, bias = arrays[f"{name}.weight"], arrays[f"{name}.bias"]
        largest = layer.weight.abs().max().item()
        assert np.abs(weight).max() == pytest.approx(largest, rel=1e-3)
        assert np.abs(bias).max() == pytest.approx(layer.bias.abs().max().item(), rel=0.1)
        assert weight.std() == pytest.approx(layer.weight.std().item(), rel=0.02)
        assert scaled[f"{name}.weight"].var() == pytest.approx(2.0 / inputs, rel=0.02)


def test_muon_takes_the_matrices_and_adam_the_rest():
    network = UnifiedNetwork(UnifiedSettings(), Whitening(0.0, 1.0))
    names = {id(p): name for name, p in network.parameters.items()}
    found = optimizers(list(network.parameters.values()), TrainingRecipe(optimizer="muon"))
    taken = [{names[id(p)] for g in o.param_groups for p in g["params"]} for o in found]
    assert taken[0] | taken[1] == set(network.parameters)
    assert not taken[0] & taken[1]
    assert taken[0] >= {"angular.4.weight", "encoder.0.weight", "decoder.1.weight"}
    assert taken[1] >= {"angular.0.weight", "decoder.4.weight", "pooled.slope", "encoder.0.bias"}
