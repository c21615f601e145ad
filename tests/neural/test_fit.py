"""The recipe from end to end."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.geometry import half_vector
from nacre.neural import Recipe, fit
from nacre.neural.file import save
from nacre.neural.recipe import PRESETS
from nacre.neural.samples import BLOCK, draw
from nacre.neural.training import initial_layers, schedule
from nacre.sampling import GgxMixture, fit_lobes
from tests.data import list_data, require_data
from tests.reflectances import Brushed, Glossy
from tests.scans import scan


class Gloss(Brdf):
    """A reddish base with a white highlight, invalid for light near the horizon."""

    name = "gloss"

    def eval_components(self, wi, wo):
        lobe = np.maximum(half_vector(wi, wo)[2], 1e-9) ** 40.0
        return 0.2 + lobe, 0.1 + lobe, 0.05 + lobe

    def valid_components(self, wi, wo):
        return wi[2] > 0.1


QUICK = Recipe(epochs=12, samples=80_000)


def relative_error(truth: Brdf, network: Brdf) -> float:
    random = np.random.default_rng(5)
    w = random.normal(size=(2, 20_000, 3))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
    wi, wo = w[:, w.min(axis=0)[:, 2] > 0.15]
    expected, got = truth.eval(wi, wo), network.eval(wi, wo)
    return float(np.median(np.abs(got - expected) / expected))


def test_a_fit_resembles_its_source_and_records_how_it_was_made():
    network = fit(Gloss(), QUICK)
    assert relative_error(Gloss(), network) < 0.03
    assert network.weight_count == 675
    assert network.isotropic
    assert isinstance(network.sampler, GgxMixture)
    assert network.sampler == fit_lobes(network)
    assert network.metadata["fit"]["epochs"] == 12
    assert 0 < network.metadata["quality"]["held_out_loss"] < 0.02


def test_an_anisotropic_fit_depends_on_the_azimuth():
    network = fit(Brushed(), QUICK)
    assert not network.isotropic
    assert relative_error(Brushed(), network) < 0.1
    wi = np.array([[0.5, 0.0, math.sqrt(0.75)], [0.0, 0.5, math.sqrt(0.75)]])
    across, along = network.eval(wi, [0.0, 0.0, 1.0])[:, 0]
    assert along > 1.5 * across


def test_the_same_seed_gives_the_same_file(tmp_path):
    recipe = Recipe(epochs=2, samples=20_000)
    for name in "ab":
        save(fit(Gloss(), recipe), tmp_path / f"{name}.safetensors")
    save(fit(Gloss(), Recipe(epochs=2, samples=20_000, seed=1)), tmp_path / "c.safetensors")
    a, b, c = ((tmp_path / f"{n}.safetensors").read_bytes() for n in "abc")
    assert a == b
    assert a != c


def test_progress_names_every_stage_with_its_end():
    calls = []
    fit(Gloss(), Recipe(epochs=3, samples=20_000), progress=lambda *call: calls.append(call))
    stages = list(dict.fromkeys(call[0] for call in calls))
    assert stages == ["sampling", "training", "sampling lobes"]
    last = [call for call in calls if call[0] == "training"][-1]
    assert last[1:3] == (3, 3)
    assert re.fullmatch(r"held-out loss 0\.\d{5} \(log\(1 \+ 32 f cos\)\)", last[3])


@pytest.mark.parametrize(
    ("inputs", "gain", "scale"),
    [
        ("paper", None, "log(1 + f cos)"),
        ("paper", 2.5, "log(1 + 2.5 f cos)"),
        ("enhanced", None, "log(1 + 32 f cos)"),
    ],
)
def test_a_loss_is_shown_with_its_scale(inputs, gain, scale):
    recipe = Recipe(epochs=1, samples=5000, inputs=inputs, gain=gain)
    notes = []
    network = fit(Gloss(), recipe, progress=lambda *call: notes.append(call[3]))
    loss = network.metadata["quality"]["held_out_loss"]
    assert network.loss_text() == f"held-out loss {loss:.5f} ({scale})"
    assert network.loss_text() in notes
    assert network.describe()["loss"] == scale
    assert network.replaced(metadata={}).loss_text() == ""


def test_the_loss_of_a_scan_has_no_gain():
    network = fit(scan(Gloss(), 400), Recipe(epochs=1, samples=5000, inputs="enhanced"))
    assert network.loss_text().endswith(" (log(1 + f cos))")
    assert network.metadata["fit"]["gain"] is None


def test_the_loss_of_an_analytic_model_is_shown_with_its_scale():
    fitted = nacre.analytic.fit(Gloss(), MODELS["lambert"], gain=8.0, samples=500, starts=1)
    assert re.fullmatch(r"loss \d\.\d{5} \(log\(1 \+ 8 f cos\)\)", fitted.loss_text())


def test_training_samples_are_uniform_in_rusinkiewicz_angles_and_valid():
    samples = draw(Gloss(), 50_000, seed=0)
    rows = samples.blocks.reshape(-1, samples.rows, BLOCK).transpose(0, 2, 1).reshape(-1, 10)
    assert len(rows) == 50_000
    assert (rows[:, 1] == 0).all()  # isotropic: h is turned to phi_h = 0
    assert (rows[:, 9] > 0.1).all()  # invalid samples are dropped
    theta_h = np.arctan2(rows[:, 0], rows[:, 2])
    theta_d = np.arccos(np.clip(rows[:, 5], -1, 1))
    # Close to the mirror direction every pair is above the horizon: counts must be proportional.
    near = theta_d < 0.6
    low, high = (near & (theta_h > a) & (theta_h < a + 0.2) for a in (0.0, 0.4))
    assert low.sum() == pytest.approx(high.sum(), rel=0.05)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [("x.bsdf", r"got a path: give it nacre\.load\('x\.bsdf'\)"), (None, "got NoneType")],
)
def test_what_is_no_reflectance_is_named(wrong, words):
    with pytest.raises(TypeError, match=words):
        fit(wrong)


def test_a_reflectance_without_valid_samples_is_refused():
    class Empty(Gloss):
        def valid_components(self, wi, wo):
            return wi[2] > 2.0

    with pytest.raises(NacreError, match="gloss: hardly any sample is valid"):
        fit(Empty(), QUICK)


def test_values_that_are_not_finite_are_left_out():
    class Spiky(Gloss):
        def eval_components(self, wi, wo):
            red, green, blue = super().eval_components(wi, wo)
            return np.where(wi[2] < 0.3, np.nan, red), green, np.where(wo[2] < 0.2, np.inf, blue)

    network = fit(Spiky(), Recipe(epochs=2, samples=20_000))
    assert math.isfinite(network.metadata["quality"]["held_out_loss"])


@pytest.mark.parametrize(
    "wrong",
    [
        {"epochs": 0},
        {"samples": 0},
        {"hidden": (21, 0)},
        {"learning_rate": -1.0},
        {"learning_rate": float("nan")},
        {"held_out": 1.0},
        {"seed": -1},
        {"batch": 500},
        {"precision": "double"},
        {"size": 20},
        {"size": 40, "inputs": "paper"},
        {"samples": 16},
        {"sample_share": 0.0},
        {"sample_share": float("nan")},
    ],
)
def test_wrong_settings_are_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Recipe(**wrong)


@pytest.mark.parametrize("inputs", ["paper", "enhanced"])
@pytest.mark.parametrize("size", [64, 400, 1192, 1350, 2700, 2800, 10_000])
def test_a_size_in_bytes_chooses_the_widest_layers(inputs, size):
    recipe = Recipe(inputs=inputs, size=size)
    bytes_a_weight = {"paper": 4, "enhanced": 2}[inputs]
    for count in (6, 7):
        first, second = recipe.widths(count)
        assert first in (second, second + 1)

        def taken(a, b, count=count):
            layers = initial_layers((a, b), 0, count)
            return bytes_a_weight * sum(y.weights.size + y.biases.size for y in layers)

        wider = (first + 1, second) if first == second else (first, second + 1)
        assert taken(first, second) <= size < taken(*wider)


def test_the_paper_s_size_gives_the_paper_s_network():
    assert Recipe(inputs="paper", size=2700).widths(6) == (21, 21)
    assert Recipe(inputs="paper", size=1350, precision="half").widths(6) == (21, 21)


def test_the_default_is_enhanced_inputs_in_half_precision():
    options = {"epochs": 1, "samples": 4000}
    default = fit(Glossy(0.3, 0.05, 0.3), Recipe(**options))
    assert (default.inputs, default.precision, default.nbytes) == ("enhanced", "half", 1350)
    settings = default.metadata["fit"]
    assert (settings["inputs"], settings["precision"], settings["gain"]) == ("enhanced", "half", 32)
    half = fit(Glossy(0.3, 0.05, 0.3), Recipe(size=300, **options))
    assert half.nbytes <= 300
    single = fit(Glossy(0.3, 0.05, 0.3), Recipe(precision="single", size=300, **options))
    assert single.precision == "single"
    assert single.weight_count < half.weight_count


def test_paper_inputs_are_stored_in_single_precision():
    network = fit(Gloss(), Recipe(inputs="paper", epochs=1, samples=4000))
    assert (network.inputs, network.precision, network.nbytes) == ("paper", "single", 2700)
    assert network.metadata["fit"]["gain"] == 1.0


def test_presets_take_more_and_more_steps_and_come_closer():
    def steps(recipe):
        return recipe.epochs * recipe.sample_share / recipe.batch

    draft, standard, best = (Recipe.preset(name) for name in PRESETS)
    assert standard == Recipe()
    assert steps(draft) < steps(standard) / 3 < steps(best) / 9
    few = {"samples": 20_000}
    losses = [fit(Gloss(), replace(recipe, **few)) for recipe in (draft, best)]
    first, last = (network.metadata["quality"]["held_out_loss"] for network in losses)
    assert last < first


def test_a_preset_is_a_start():
    recipe = Recipe.preset("draft", epochs=2, seed=3)
    assert (recipe.epochs, recipe.seed) == (2, 3)
    assert recipe.learning_rate == PRESETS["draft"]["learning_rate"]
    network = fit(Gloss(), replace(recipe, sample_share=0.01))
    assert network.metadata["fit"]["samples"] == 8000
    with pytest.raises(ValueError, match="preset must be one of draft, standard, best"):
        Recipe.preset("perfect")


def test_the_schedule_warms_up_peaks_and_ends_near_zero():
    rates = schedule(1000, 1e-2)
    assert rates[0] == pytest.approx(5e-4)
    assert rates.max() == pytest.approx(1e-2, rel=1e-3)
    assert rates.argmax() == pytest.approx(20, abs=1)
    assert 0 < rates[-1] < 1e-6
    assert len(schedule(1, 1e-2)) == 1


@pytest.mark.parametrize("name", list_data("rgl", "*.bsdf")[:2] or ["satin_rosaline_rgb.bsdf"])
def test_a_real_table_fits(name):
    brdf = nacre.load(require_data("rgl", name))
    losses = [
        fit(brdf, Recipe(epochs=epochs, samples=80_000)).metadata["quality"]["held_out_loss"]
        for epochs in (1, 8)
    ]
    assert losses[1] < 0.6 * losses[0] < 0.2
    network = fit(brdf, Recipe(epochs=1, samples=16_000))
    assert network.metadata["source"]["file"] == name
