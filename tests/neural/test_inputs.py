"""The parametrizations of a network's inputs."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace

import numpy as np
import pytest

import nacre
from nacre.brdf import Brdf
from nacre.errors import FormatError, NacreError
from nacre.geometry import half_difference, isotropic, join, rotate, split, uniform_rusinkiewicz
from nacre.neural import Layer, NeuralBrdf, Recipe, fit
from nacre.neural.axes import main_axis
from nacre.neural.inputs import (
    ENHANCED,
    INPUTS,
    LARGEST_INPUT,
    PAPER,
    RECIPROCAL,
    SPINNING,
    STEREOGRAPHIC,
    has_axes,
    input_count,
    network_inputs,
    rotates_half_vector,
)
from nacre.neural.prune import without_inactive_units
from nacre.neural.samples import BLOCK, draw
from nacre.numerics.mlp import forward as mlp_forward
from nacre.sampling import draw_samples
from tests.reflectances import Beckmann, Brushed, Glossy


def pairs(count: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    wi, wo = (join(w) for w in uniform_rusinkiewicz(random.random((4, count))))
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    return wi[above], wo[above]


def network(inputs: str, turned: bool, angle: float = 0.0) -> NeuralBrdf:
    random = np.random.default_rng(0)
    sizes = (input_count(inputs, turned), 21, 21, 3)
    layers = [
        Layer(random.normal(0, 0.4, (a, b)), np.full(b, 0.1)) for a, b in itertools.pairwise(sizes)
    ]
    return NeuralBrdf(layers, isotropic=turned, inputs=inputs, angle=angle)


def test_the_papers_inputs_are_the_half_and_difference_vectors():
    wi, wo = map(split, pairs())
    h, d = half_difference(wi, wo)
    np.testing.assert_array_equal(network_inputs(wi, wo, False, PAPER), [*h, *d])
    turned = [*np.broadcast_arrays(*isotropic(h)), *d]
    np.testing.assert_array_equal(np.broadcast_arrays(*network_inputs(wi, wo, True, PAPER)), turned)


@pytest.mark.parametrize("inputs", INPUTS)
@pytest.mark.parametrize("turned", [True, False])
def test_inputs_are_bounded_up_to_the_horizon(inputs, turned):
    wi, wo = pairs()
    grazing = wi * [1.0, 1.0, 1e-9]
    grazing /= np.linalg.norm(grazing, axis=1, keepdims=True)
    mirror = wi * [-1.0, -1.0, 1.0]
    for light, view in ((wi, wo), (grazing, wo), (wo, grazing), (wi, mirror), (-wi, wo)):
        values = network_inputs(split(light), split(view), turned, inputs)
        assert len(values) == input_count(inputs, turned)
        assert all(np.isfinite(v).all() and np.abs(v).max() <= LARGEST_INPUT for v in values)


def test_isotropic_networks_of_enhanced_inputs_are_mirror_symmetric():
    wi, wo = pairs()
    flip = np.array([1.0, -1.0, 1.0])
    enhanced, paper = network(ENHANCED, True), network(PAPER, True)
    np.testing.assert_allclose(
        enhanced.eval(wi, wo), enhanced.eval(wi * flip, wo * flip), rtol=1e-12
    )
    assert np.abs(paper.eval(wi, wo) - paper.eval(wi * flip, wo * flip)).max() > 1e-3


NEVER_TURNED = STEREOGRAPHIC, SPINNING
KINDS = [
    (inputs, turned)
    for inputs in INPUTS
    for turned in (True, False)
    if not (turned and inputs in NEVER_TURNED)
]


@pytest.mark.parametrize(("inputs", "turned"), KINDS)
def test_files_keep_the_inputs(tmp_path, inputs, turned):
    before = network(inputs, turned, 0.5 if has_axes(inputs, turned) else 0.0)
    nacre.save(before, tmp_path / "x.safetensors")
    after = nacre.load(tmp_path / "x.safetensors")
    assert isinstance(after, NeuralBrdf)
    assert (after.inputs, after.isotropic, after.angle) == (inputs, turned, before.angle)
    np.testing.assert_array_equal(after.eval(*pairs()), before.eval(*pairs()))


def test_files_of_before_are_evaluated_as_before(tmp_path):
    saved = network(SPINNING, False)
    nacre.save(saved, tmp_path / "x.safetensors")
    assert b'\\"enhanced rusinkiewicz vectors\\"' in (tmp_path / "x.safetensors").read_bytes()
    wi, wo = pairs()
    h, d = half_difference(split(wi), split(wo))
    highlight = np.log(h[0] ** 2 + h[1] ** 2 + 1e-4) / 9.2
    light, view = (np.log(w[:, 2] + 0.01) / 4.6 for w in (wi, wo))
    values = np.stack([h[0], h[1], highlight, light, view, d[0], d[1]], -1)
    expected = np.maximum(np.exp(mlp_forward(values, saved.layers)) - 1.0, 0.0)
    found = nacre.load(tmp_path / "x.safetensors").eval(wi, wo)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def anisotropic(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return np.stack(network_inputs(split(wi), split(wo), False, ENHANCED), -1)


@pytest.mark.parametrize("flip", [(-1, 1, 1), (1, -1, 1), (-1, -1, 1)])
def test_enhanced_inputs_turn_and_mirror_with_the_axes(flip):
    wi, wo = pairs()
    x, y = flip[:2]
    expected = anisotropic(wi, wo) * [x, y, 1, 1, 1, 1, x, y]
    np.testing.assert_array_equal(anisotropic(wi * flip, wo * flip), expected)


def test_axes_at_an_angle_are_those_of_a_turned_material():
    wi, wo = pairs()
    cos, sin = math.cos(0.5), math.sin(0.5)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])  # its rows by -0.5
    straight, turned = network(ENHANCED, False), network(ENHANCED, False, 0.5)
    expected = straight.eval(wi @ turn, wo @ turn)
    np.testing.assert_allclose(turned.eval(wi, wo), expected, rtol=1e-9, atol=1e-12)


class Weave(Brdf):
    """Two lobes across each other, turned by an angle."""

    isotropic = False

    def __init__(self, angle: float, second: float) -> None:
        super().__init__()
        self.angle, self.second = angle, second

    def eval_components(self, wi, wo):
        turned = [rotate(w, -self.angle) for w in (wi, wo)]
        lobes = Beckmann(0.0, 0.5, 0.1, 0.4), Beckmann(0.0, self.second, 0.4, 0.1)
        one, other = (lobe.eval_components(*turned) for lobe in lobes)
        return tuple(a + b for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("second", [0.0, 0.5])
@pytest.mark.parametrize("degrees", [0, 17, 45, 80])
def test_the_axes_of_a_lobe_and_of_two_that_cross_are_found(degrees, second):
    truth = Weave(math.radians(degrees), second)
    samples = draw_samples(truth, 40_000, 1, distribution="mixed")
    assert math.degrees(main_axis(samples)) == pytest.approx(degrees, abs=1.0)


def test_a_material_without_axes_keeps_those_of_the_frame():
    samples = draw_samples(Glossy(0.2, 0.1, 0.1), 10_000, 1, distribution="mixed")
    assert main_axis(samples) == 0.0


def test_fits_find_the_axes_and_files_keep_them(tmp_path):
    truth = Weave(math.radians(30.0), 0.0)
    fitted = fit(truth, Recipe(epochs=1, samples=20_000, inputs=ENHANCED))
    assert fitted.angle == pytest.approx(math.radians(30.0), abs=0.02)
    nacre.save(fitted, tmp_path / "x.safetensors")
    again = nacre.load(tmp_path / "x.safetensors")
    assert again.angle == fitted.angle
    assert without_inactive_units(fitted).angle == fitted.angle


def test_angles_without_axes_and_beyond_a_right_one_are_refused():
    for inputs, angle in ((PAPER, 0.5), (ENHANCED, -0.1), (ENHANCED, 2.0), (ENHANCED, math.nan)):
        with pytest.raises(ValueError, match="ax"):
            network(inputs, False, angle)


def test_enhanced_inputs_are_smooth_where_the_half_vector_is_the_normal():
    random = np.random.default_rng(5)
    wi, _ = pairs(2000)
    wi = wi[wi[:, 2] > 0.3]
    wo = wi * [-1.0, -1.0, 1.0]
    near = wo + random.normal(0.0, 1e-6, wo.shape)
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    assert np.abs(anisotropic(wi, near) - anisotropic(wi, wo)).max() < 1e-4
    _, spun = half_difference(split(wi), split(near))
    _, still = half_difference(split(wi), split(wo))
    assert np.median(np.abs(spun[1] - still[1])) > 0.1  # what a frame that spins does there


def test_enhanced_inputs_are_the_same_in_torch_with_finite_gradients():
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    wi, wo = pairs(500)
    mirrored = wi * [-1.0, -1.0, 1.0]
    for light, view in ((wi, wo), (wi, mirrored)):
        tensors = [torch.tensor(w, requires_grad=True) for w in (light, view)]
        values = network_inputs(*(t.unbind(-1) for t in tensors), False, ENHANCED)
        found = torch.stack(values, -1)
        np.testing.assert_allclose(found.detach().numpy(), anisotropic(light, view), atol=1e-13)
        found.sum().backward()
        assert all(torch.isfinite(t.grad).all() for t in tensors)


def test_published_files_hold_the_papers_inputs_only(tmp_path):
    with pytest.raises(FormatError, match="paper's inputs"):
        nacre.save(network(ENHANCED, True), tmp_path / "x.h5")
    assert not list(tmp_path.iterdir())


def test_unknown_inputs_and_wrong_gains_are_refused():
    with pytest.raises(NacreError, match="paper, enhanced, stereographic"):
        Recipe(inputs="better")
    for gain in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(ValueError, match="gain"):
            Recipe(gain=gain)
    assert (Recipe(inputs=PAPER).loss_gain, Recipe().loss_gain) == (1.0, 32.0)
    assert Recipe(gain=2.0).loss_gain == 2.0


def test_a_gain_scales_what_the_loss_sees():
    plain, scaled = (
        draw(Glossy(0.2, 0.3, 0.3), 4096, 1, gain=k).blocks.reshape(-1, 10, BLOCK)
        for k in (1.0, 16.0)
    )
    np.testing.assert_array_equal(scaled[:, :6], plain[:, :6])
    np.testing.assert_allclose(scaled[:, 9], 16.0 * plain[:, 9], rtol=1e-6)
    np.testing.assert_allclose(scaled[:, 6:9], 16.0 * plain[:, 6:9], rtol=1e-6)


def dark_error(truth: nacre.Brdf, brdf: nacre.Brdf) -> float:
    wi, wo = pairs()
    a, b = (np.log1p(32.0 * x.eval(wi, wo) * wi[:, 2:]) for x in (truth, brdf))
    return float(np.abs(a - b).mean())


def test_a_gain_brings_the_dark_parts_closer():
    truth = Glossy(0.01, 0.02, 0.2)
    recipe = Recipe(epochs=12, samples=80_000, sampling="rusinkiewicz", inputs="paper")
    plain, scaled = (fit(truth, replace(recipe, gain=k)) for k in (1.0, 32.0))
    assert dark_error(truth, scaled) < 0.85 * dark_error(truth, plain)


@pytest.mark.parametrize("truth", [Glossy(0.2, 0.1, 0.1), Brushed()], ids=["isotropic", "brushed"])
def test_networks_of_enhanced_inputs_fit(truth):
    count = 80_000 if truth.isotropic else 200_000
    network = fit(truth, Recipe(epochs=12, samples=count, inputs=ENHANCED))
    assert network.metadata["fit"]["inputs"] == ENHANCED
    assert network.metadata["fit"]["gain"] == 32.0
    assert dark_error(truth, network) < 0.03


def test_stereographic_inputs_are_projections_of_light_and_view():
    wi, wo = pairs()
    values = network_inputs(split(wi), split(wo), False, STEREOGRAPHIC)
    for w, (x, y) in ((wi, values[:2]), (wo, values[2:])):
        # The projection halves the polar angle: its radius is tan(theta / 2).
        theta = np.arccos(w[:, 2])
        np.testing.assert_allclose(np.hypot(x, y), np.tan(theta / 2), rtol=1e-6)
        np.testing.assert_allclose(np.arctan2(y, x), np.arctan2(w[:, 1], w[:, 0]), atol=1e-9)


def test_networks_of_stereographic_inputs_learn_azimuths_and_blur_highlights():
    truth = Glossy(0.2, 0.1, 0.05)
    recipe = Recipe(epochs=12, samples=80_000, sampling="rusinkiewicz")
    paper, projected = (fit(truth, replace(recipe, inputs=i)) for i in (PAPER, STEREOGRAPHIC))
    assert not projected.isotropic
    assert projected.sizes == (4, 21, 21, 3)
    assert projected.metadata["fit"]["gain"] == 1.0
    assert dark_error(truth, projected) > 3.0 * dark_error(truth, paper)
    wi, wo = pairs()
    turn = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    one, turned = projected.eval(wi, wo), projected.eval(wi @ turn, wo @ turn)
    diffuse = half_difference(split(wi), split(wo))[0][2] < 0.8
    assert np.median((np.abs(one - turned) / truth.eval(wi, wo))[diffuse]) < 0.15
    high = wi[wi[:, 2] > 0.4]
    near = high * [-1.0, -1.0, 1.0] + np.random.default_rng(1).normal(0.0, 0.1, high.shape)
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    expected, exact, blurred = (x.eval(high, near)[:, 0] for x in (truth, paper, projected))
    errors = [np.median(np.abs(x / expected - 1.0)[near[:, 2] > 0.1]) for x in (exact, blurred)]
    assert errors[1] > 2.0 * errors[0]


@pytest.mark.parametrize("inputs", NEVER_TURNED)
def test_isotropic_networks_have_no_inputs_that_turn_with_azimuths(inputs):
    assert not rotates_half_vector(inputs, True)
    with pytest.raises(ValueError, match=inputs):
        network(inputs, True)


@pytest.mark.parametrize(
    ("inputs", "isotropic", "words"),
    [
        (PAPER, True, "rusinkiewicz vectors, phi_h = 0"),
        (PAPER, False, "rusinkiewicz vectors"),
        (ENHANCED, True, "enhanced rusinkiewicz vectors, phi_h = 0"),
        (ENHANCED, False, "enhanced half vectors along x and y, light carried to the pole"),
        (SPINNING, False, "enhanced rusinkiewicz vectors"),
        (STEREOGRAPHIC, False, "stereographic light and view"),
        (RECIPROCAL, True, "reciprocal rusinkiewicz vectors, phi_h = 0"),
        (RECIPROCAL, False, "reciprocal rusinkiewicz vectors"),
    ],
)
def test_headers_say_what_earlier_files_say(tmp_path, inputs, isotropic, words):
    """Words of files that are in use: other programs read them."""
    path = tmp_path / "x.safetensors"
    before = network(inputs, isotropic)
    nacre.save(before, path)
    content = path.read_bytes()
    size = int.from_bytes(content[:8], "little")
    header = json.loads(json.loads(content[8 : 8 + size])["__metadata__"]["nacre"])
    assert header["parametrisation"] == words
    assert header["output"] == ("exp(x)" if "reciprocal" in words else "exp(x) - 1, clamped at 0")
    assert (header["model"], header["color_space"]) == ("nbrdf", "linear Rec. 709")
    assert header["sizes"] == list(before.sizes)
    assert ("angle" in header) == (words.startswith("enhanced half"))
