"""Physical networks: reciprocity, energy and positivity, by construction and after fits."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.array import Components
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.geometry import join, uniform_hemisphere
from nacre.metrics.facts import physical_facts
from nacre.metrics.physics import albedo
from nacre.neural.fitting import fit
from nacre.neural.inputs import ENHANCED, RECIPROCAL
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.physical import limited
from nacre.neural.recipe import Recipe
from nacre.numerics.mlp import RELU, Layer
from nacre.sampling.energy import albedos, certify
from nacre.sampling.projection import LIMIT, Projection
from tests.analytic.materials import EXAMPLES
from tests.cli.support import assert_refused
from tests.mitsuba.reflectances import Constant, Lobe, Tilted, network
from tests.reflectances import Beckmann, Brushed, Glossy, Rotated
from tests.scans import scan
from tests.tiers import tiered

QUICK = Recipe(physical=True, samples=12_000, epochs=6, batch=128, hidden=(12, 12))


class Bright(Constant):
    """Half as much light again as falls in, and more the lower the light."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        red, green, blue = super().eval_components(wi, wo)
        scale = 1.5 + 1.0 / (wi[2] + 0.1)
        return scale * red, scale * green, scale * blue


MATERIALS: dict[str, Brdf] = {
    **dict(list(EXAMPLES.items())[:10]),
    "diffuse": Glossy(0.5, 0.0, 0.5),
    "white": Constant(1.0, 1.0, 1.0),
    "glossy": Glossy(0.2, 0.05, 0.3),
    "sharp": Glossy(0.1, 0.5, 0.03),
    "metal": Beckmann(0.0, 1.0, 0.05),
    "lobe": Lobe(500.0),
    "tilted": Tilted(0.2, 0.5, 1.0),
    "bright": Bright(0.9, 0.5, 0.1),
    "brushed": Brushed(),
    "rough metal": Beckmann(0.0, 1.0, 0.3),
}


def pairs(count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    u = np.random.default_rng(5).random((4, count))
    return join(uniform_hemisphere(u[0], u[1])), join(uniform_hemisphere(u[2], u[3]))


@pytest.mark.parametrize("isotropic", [True, False])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_swapping_light_and_view_changes_no_bit(isotropic, kind):
    made = network(3, inputs=RECIPROCAL, isotropic=isotropic)
    wi, wo = (w.astype(kind) for w in pairs())
    found = made.eval(wi, wo)
    np.testing.assert_array_equal(found, made.eval(wo, wi))
    assert found.min() > 0.0
    assert found.std() > 0.01
    plain = network(3, inputs=ENHANCED, isotropic=isotropic)
    assert np.abs(plain.eval(wi, wo) - plain.eval(wo, wi)).max() > 1e-3


@pytest.mark.parametrize("isotropic", [True, False])
def test_swapping_changes_no_bit_in_pytorch(isotropic):
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    made = network(3, inputs=RECIPROCAL, isotropic=isotropic)
    wi, wo = (torch.from_numpy(w).unbind(-1) for w in pairs())
    there, back = (torch.stack(made.eval_components(*pair)) for pair in ((wi, wo), (wo, wi)))
    assert torch.equal(there, back)
    np.testing.assert_allclose(there.numpy().T, made.eval(*pairs()), rtol=1e-10)


def test_only_the_swap_is_forgotten():
    """Two pairs with the same inputs are the same but for a swap, and a mirror if isotropic."""
    wi, wo = pairs()
    for turn in (np.diag([-1.0, 1.0, 1.0]), np.eye(3)[[1, 0, 2]]):
        plain, moved = wi @ turn, wo @ turn
        made = network(3, inputs=RECIPROCAL, isotropic=False)
        assert np.abs(made.eval(wi, wo) - made.eval(plain, moved)).max() > 1e-3
    lower = wi * [1.0, 1.0, 0.5]
    lower /= np.linalg.norm(lower, axis=1, keepdims=True)
    for isotropic in (True, False):
        made = network(3, inputs=RECIPROCAL, isotropic=isotropic)
        assert np.abs(made.eval(wi, wo) - made.eval(lower, wo)).max() > 1e-3


def test_outputs_of_any_size_are_finite():
    made = network(3, inputs=RECIPROCAL)
    last = Layer(made.layers[-1].weights, np.array([900.0, -900.0, 0.0]))
    wi, wo = (w.astype(np.float32) for w in pairs())
    found = made.with_layers([*made.layers[:-1], last]).eval(wi, wo)
    assert np.isfinite(found).all()
    assert (found >= 0.0).all()


@pytest.mark.parametrize("white", [0.25, 1.0])
def test_integrals_over_half_vectors_of_a_lambertian_are_exact(white):
    theta = np.radians([0.0, 30.0, 60.0, 85.0, 89.9])
    found = albedos(Constant(white, 0.5, 0.1), np.stack([theta, theta]), 16)
    np.testing.assert_allclose(found[:, 0], white, rtol=1e-4)


@pytest.mark.parametrize("rough", [0.03, 0.3])
def test_integrals_over_half_vectors_are_those_of_drawn_points(rough):
    theta = np.radians([0.0, 40.0, 75.0, 88.0])
    truth = Glossy(0.2, 0.5, rough, rough * 2)
    expected = albedo(truth, theta, 0.7)
    found = albedos(truth, np.stack([theta, np.full(4, 0.7)]), 16)
    np.testing.assert_allclose(found, expected.value, atol=5.0 * expected.error.max())


def test_a_projection_is_the_mean_of_both_orders():
    wi, wo = pairs()
    plain = Projection(Tilted(0.1, 0.2, 0.3))
    assert plain.factors is None
    f = plain.eval(wi, wo)
    np.testing.assert_allclose(f, plain.eval(wo, wi), rtol=1e-12)
    high = (wi[:, 2] > 0.3) & (wo[:, 2] > 0.3)
    mean = 0.5 * (Tilted(0.1, 0.2, 0.3).eval(wi, wo) + Tilted(0.1, 0.2, 0.3).eval(wo, wi))
    np.testing.assert_allclose(f[high], mean[high], rtol=0.03)


@pytest.mark.parametrize("truth", [Bright(0.9, 0.5, 0.1), Rotated(0.9, 0.6, 0.2, 0.5)])
def test_a_projection_keeps_to_the_limit_and_leaves_what_is_below_it(truth):
    angles = np.radians([[1.0, 30.0, 60.0, 80.0, 88.0], [0.0, 50.0, 100.0, 200.0, 300.0]])
    projected = Projection(truth)
    found = albedos(projected, angles, 16)
    assert found.max() <= LIMIT + 0.01
    assert found[:, 0].max() > LIMIT - 0.02
    wi, wo = pairs(500)
    np.testing.assert_allclose(projected.eval(wi, wo), projected.eval(wo, wi), rtol=1e-12)


def test_a_network_that_gains_energy_is_scaled_as_a_whole():
    before = network(3, inputs=RECIPROCAL)
    after = limited(before)
    facts = after.metadata["physical"]
    ratio = after.eval(*pairs()) / before.eval(*pairs())
    np.testing.assert_allclose(ratio, facts["factor"], rtol=1e-4)
    assert facts["factor"] < 0.5
    assert 0.97 < facts["largest_albedo"] <= facts["albedo_bound"] <= 1.0
    wanted = albedo(after, np.radians(np.arange(0, 90, 5))).value.max()
    assert facts["largest_albedo"] == pytest.approx(wanted, abs=0.02)
    half = limited(
        NeuralBrdf(
            [Layer(*(a.astype(np.float16) for a in layer)) for layer in before.layers],
            inputs=RECIPROCAL,
            precision="half",
        )
    )
    assert certify(half).bound <= 1.0


@pytest.mark.parametrize("name", tiered(MATERIALS, list(MATERIALS)[::5]))
def test_fits_are_reciprocal_positive_and_lose_energy(name):
    """Albedos by points that the fit does not integrate by, at views of its own."""
    truth = MATERIALS[name]
    made = fit(truth, QUICK)
    assert made.isotropic == truth.isotropic
    wi, wo = pairs(1000)
    found = made.eval(wi, wo)
    np.testing.assert_array_equal(found, made.eval(wo, wi))
    assert found.min() > 0.0
    theta = np.radians([3.0, 33.0, 63.0, 83.0, 88.7])
    seen = albedo(made, theta, 1.1, count=256)
    bound = made.metadata["physical"]["albedo_bound"]
    assert bound <= 1.0
    assert (seen.value <= bound + 4.0 * seen.error + 1e-3).all()


def test_a_fit_comes_close_to_a_material_that_is_physical():
    truth = Glossy(0.2, 0.1, 0.2)
    recipe = Recipe(samples=80_000, epochs=12, inputs=ENHANCED, activation=RELU)
    plain = fit(truth, recipe)
    made = fit(truth, dataclasses.replace(recipe, inputs=None, physical=True))
    wi, wo = pairs()
    expected = np.log1p(32.0 * truth.eval(wi, wo) * wi[:, 2:])
    errors = [
        np.abs(np.log1p(32.0 * x.eval(wi, wo) * wi[:, 2:]) - expected).mean() for x in (plain, made)
    ]
    assert errors[1] < 1.2 * errors[0]
    assert made.metadata["physical"]["factor"] == 1.0


def test_files_keep_physical_networks_and_info_says_what_holds(tmp_path):
    path = tmp_path / "x.safetensors"
    nacre.save(fit(Glossy(0.2, 0.1, 0.3), QUICK), path)
    after = nacre.load(path)
    assert after.physical
    assert after.metadata["fit"]["physical"]
    facts = physical_facts(after)
    assert facts["reciprocity"] == "by construction"
    assert facts["negative values"] == "none, by construction"
    assert facts["reciprocity error"] == 0.0
    assert facts["energy"].startswith("nowhere above 1, certified: at most 0.")
    plain = physical_facts(Glossy(0.2, 0.1, 0.3))
    assert plain["reciprocity"] == "found by integration"
    assert plain["energy"] == "nowhere above 1, found by integration"
    assert not math.isnan(facts["reciprocity standard error"])


def test_what_has_no_physical_fit_is_refused():
    with pytest.raises(NacreError, match="scattered samples only"):
        fit(scan(Glossy(0.2, 0.1, 0.3), 200), QUICK)
    for settings in ({"physical": True, "inputs": ENHANCED}, {"inputs": RECIPROCAL}):
        with pytest.raises(ValueError, match="reciprocal inputs"):
            Recipe(**settings)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--inputs", "paper"], "leave out --inputs"),
        (["-o", "x.h5"], "paper's inputs and activation only"),
        (["--model", "ggx"], "--physical is for"),
    ],
)
def test_the_command_refuses_what_does_not_go_with_physical(
    tmp_path, monkeypatch, capsys, options, words
):
    monkeypatch.chdir(tmp_path)
    nacre.save(EXAMPLES["ggx"], Path("x.json"))
    assert_refused(capsys, words, "fit", "x.json", "--physical", *options)
