"""The kernel with which the page fits networks, against what nacre fit does."""

from __future__ import annotations

import importlib.util
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nacre.analytic import AnisotropicGgx, Ggx
from nacre.array import aligned_zeros
from nacre.measured.scattered import ScatteredBrdf
from nacre.neural import fitting, replicas
from nacre.neural.axes import main_axis
from nacre.neural.inputs import ENHANCED, PAPER, network_inputs
from nacre.neural.kernel import KernelTrainer
from nacre.neural.recipe import Recipe
from nacre.neural.samples import BLOCK, Samples, draw
from nacre.neural.training import initial_layers
from nacre.numerics.mlp import RELU, SQUARED_RELU
from nacre.sampling import draw_samples, fit_lobes
from nacre.sampling.moment import propose
from nacre.viewer.fits import kernel
from nacre.viewer.page import script
from tests.measured.support import hemisphere
from tests.oracles.kernel import FOLDER, NativeTrainer, call, missing, random
from tests.targets.support import needs

ROOT = Path(__file__).parents[2]
GRAY = {"diffuse": (0.2, 0.1, 0.05), "specular": (0.3, 0.3, 0.3)}
SHINY = Ggx(**GRAY, roughness=0.2)
BRUSHED = AnisotropicGgx(**GRAY, roughness_x=0.1, roughness_y=0.4, angle=0.5)
BATCH = 512


@pytest.fixture(scope="module", autouse=True)
def _compiler():
    needs(missing())


def sampled(brdf=SHINY, count=8192, inputs=ENHANCED, gain=32.0) -> Samples:
    return draw(brdf, count, 0, None, inputs, gain)


def flat(layers) -> np.ndarray:
    return np.concatenate([part.ravel() for layer in layers for part in layer])


@pytest.mark.parametrize("seed", [(0,), (0, 1), (7, 2, 3)])
def test_random_numbers_are_those_of_numpy(seed):
    theirs = np.random.default_rng(seed[0] if len(seed) == 1 else seed)
    ours = random(*seed)
    floats, doubles = np.zeros(1001, np.float32), np.zeros(99)
    order, normals = np.zeros(5000, np.int32), np.zeros(30000, np.float32)
    call("random_floats", ours, floats, len(floats))
    np.testing.assert_array_equal(floats, theirs.random(len(floats), np.float32))
    call("random_doubles", ours, doubles, len(doubles))
    np.testing.assert_array_equal(doubles, theirs.random(len(doubles)))
    call("random_order", ours, order, len(order))
    np.testing.assert_array_equal(order, theirs.permutation(len(order)))
    call("random_normals", ours, 0.3, normals, len(normals))
    expected = theirs.normal(0.0, 0.3, len(normals)).astype(np.float32)
    np.testing.assert_allclose(normals, expected, rtol=1e-6)


FORMS = [
    (SHINY, ENHANCED, (21, 21), SQUARED_RELU),
    (BRUSHED, ENHANCED, (21, 21), SQUARED_RELU),
    (SHINY, PAPER, (13, 8), RELU),
    (BRUSHED, PAPER, (5,), RELU),
]


@pytest.mark.parametrize(("brdf", "inputs", "hidden", "activation"), FORMS)
def test_gradient_and_loss_are_those_of_nacre_fit(brdf, inputs, hidden, activation):
    samples = sampled(brdf, 2048, inputs, 32.0 if inputs == ENHANCED else 1.0)
    layers = initial_layers(hidden, 3, samples.inputs)
    ours, theirs = (
        Trainer(layers, BATCH, activation) for Trainer in (NativeTrainer, KernelTrainer)
    )
    for order in (np.arange(32), np.arange(7, 38)):  # whole panels, and the rest of one
        expected = flat(theirs.gradient(samples, order)[1])
        found = flat(ours.gradient(samples, order))
        np.testing.assert_allclose(found, expected, atol=2e-5 * np.abs(expected).max())
    assert ours.loss(samples) == pytest.approx(theirs.loss(samples), rel=1e-6)


def test_gradient_of_a_scan_goes_on_below_zero():
    """Weights above 1, as samples of scans have."""
    drawn = sampled(SHINY, 1024, PAPER, 1.0)
    drawn.blocks.reshape(-1, drawn.rows, BLOCK)[:, -4:] *= 100.0
    layers = initial_layers((9, 9), 0, drawn.inputs)
    order = np.arange(32)
    ours, theirs = (Trainer(layers, BATCH) for Trainer in (NativeTrainer, KernelTrainer))
    loss, gradient = theirs.gradient(drawn, order)
    expected = flat(gradient)
    assert loss > 0.1
    found = flat(ours.gradient(drawn, order))
    np.testing.assert_allclose(found, expected, atol=2e-5 * np.abs(expected).max())
    assert ours.loss(drawn) == pytest.approx(theirs.loss(drawn), rel=1e-6)


def test_steps_are_those_of_nacre_fit():
    samples = sampled()
    layers = initial_layers((21, 21), 0, samples.inputs)
    ours, theirs = (
        Trainer(layers, BATCH, SQUARED_RELU) for Trainer in (NativeTrainer, KernelTrainer)
    )
    order = np.random.default_rng(0).permutation(samples.block_count)
    rates = np.full(16, 1e-3, np.float32)
    for trainer in (ours, theirs):
        trainer.epoch(samples, order, rates)
    assert ours.steps == theirs.steps == 16
    np.testing.assert_allclose(flat(ours.layers()), flat(theirs.layers()), atol=2e-5)


def test_a_whole_fit_is_that_of_nacre_fit(monkeypatch):
    recipe = Recipe(samples=20_000, epochs=40, learning_rate=2e-2, seed=1)
    theirs = fitting.fit(SHINY, recipe)
    monkeypatch.setattr(replicas, "KernelTrainer", NativeTrainer)
    ours = fitting.fit(SHINY, recipe)
    loss, expected = (x.metadata["quality"]["held_out_loss"] for x in (ours, theirs))
    # Sums are added in another order, and so training goes another way.
    assert loss == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize("brdf", [SHINY, BRUSHED])
def test_lobes_are_those_of_nacre(brdf):
    count, mixture = call("lobes_points"), np.zeros(37)
    moment = np.zeros(call("lobes_bytes") // 8)
    wi, wo, rgb = np.zeros((3, count, 4), np.float32)
    call("lobes_propose", moment, random(0), wi, wo)
    proposal = propose(0)
    np.testing.assert_allclose(wi[:, :3], proposal.wi.reshape(-1, 3), atol=1e-7)
    np.testing.assert_allclose(wo[:, :3], proposal.wo.reshape(-1, 3), atol=1e-7)
    rgb[:, :3] = brdf.eval(proposal.wi, proposal.wo).reshape(-1, 3)
    call("lobes_fit", moment, rgb, int(brdf.isotropic), mixture)
    np.testing.assert_allclose(mixture, numbers(fit_lobes(brdf)), atol=0.01)


def numbers(mixture) -> np.ndarray:
    """A mixture as the kernel has it."""
    fields = "fraction", "roughness", "across", "shift"
    lobes = [getattr(lobe, field) for lobe in mixture.lobes for field in fields]
    head = [len(mixture.lobes), 3, mixture.angle is not None, mixture.angle or 0.0]
    lists = [mixture.cosines, mixture.uniform, mixture.squared, *lobes]
    return np.concatenate([head, np.ravel(lists)])


@pytest.mark.parametrize("brdf", [SHINY, BRUSHED])
def test_directions_are_those_of_nacre(brdf):
    chunk = 1 << 15
    lit = brdf.replaced(sampler=fit_lobes(brdf))
    expected = draw_samples(lit, 20000, 3, distribution="mixed")
    wi, wo = np.zeros((2, chunk, 4), np.float32)
    u = np.zeros(6 * chunk, np.float32)
    drawn = call(
        "samples_draw", random(3, 0), u, chunk, int(brdf.isotropic), numbers(lit.sampler), wi, wo
    )
    assert drawn >= 20000
    close = np.isclose(wi[:20000, :3], expected.wi, atol=1e-5).all(axis=1)
    close &= np.isclose(wo[:20000, :3], expected.wo, atol=1e-5).all(axis=1)
    # A direction at the horizon, or between two lobes, may fall to either side.
    assert close.mean() > 0.999


@pytest.mark.parametrize("inputs", [PAPER, ENHANCED])
@pytest.mark.parametrize("isotropic", [True, False])
def test_inputs_are_those_of_nacre(inputs, isotropic):
    drawn = draw_samples(BRUSHED, 4096, 0)
    angle = 0.3 if inputs == ENHANCED and not isotropic else 0.0
    wi, wo, rgb = np.ones((3, 4096, 4), np.float32)
    for to, values in ((wi, drawn.wi), (wo, drawn.wo), (rgb, drawn.rgb)):
        to[:, :3] = values
    columns = network_inputs(*(tuple(w.T) for w in (drawn.wi, drawn.wo)), isotropic, inputs, angle)
    expected = Samples.pack(
        np.stack(np.broadcast_arrays(*columns), -1), drawn.rgb, 32.0 * drawn.cosine
    )
    blocks = np.zeros_like(expected.blocks)
    kind = 2 * (inputs == ENHANCED) + (not isotropic)
    filled = call("samples_fill", blocks, 0, 4096, wi, wo, rgb, 4096, kind, float(angle), 32.0, 0.0)
    assert filled == 4096
    np.testing.assert_allclose(blocks, expected.blocks, rtol=2e-5, atol=2e-5)


def test_samples_that_are_not_known_are_left_out():
    wi, wo, rgb = np.ones((3, 32, 4), np.float32)
    rgb[3, 3], rgb[5, 0], rgb[7, 1] = 0.0, math.nan, math.inf
    blocks = np.zeros(10 * 32, np.float32)
    assert call("samples_fill", blocks, 0, 32, wi, wo, rgb, 32, 2, 0.0, 1.0, 0.0) == 29
    assert call("samples_fill", blocks, 29, 31, wi, wo, rgb, 32, 2, 0.0, 1.0, 0.0) == 31


def test_axes_are_those_of_nacre():
    drawn = draw_samples(BRUSHED, 1 << 15, 0)
    wi, wo, rgb = np.zeros((3, 1 << 15, 4), np.float32)
    for to, values in ((wi, drawn.wi), (wo, drawn.wo), (rgb, drawn.rgb)):
        to[:, :3] = values
    errors = [call("samples_axis", wi, wo, rgb, 1 << 15, degrees) for degrees in range(0, 90, 1)]
    assert int(np.argmin(errors)) == round(math.degrees(main_axis(drawn)))


@pytest.mark.parametrize("lights", [None, 4])
def test_scans_are_interpolated_as_by_nacre(lights):
    random_ = np.random.default_rng(0)
    wi, wo = (hemisphere(random_, 600) for _ in range(2))
    if lights:  # as a goniometer takes slices
        wi = wi[:lights][np.arange(600) % lights]
    scan = ScatteredBrdf(wi, wo, SHINY.eval(wi, wo))
    packed = [np.pad(np.float32(w), ((0, 0), (0, 1))) for w in (wi, wo, scan.samples.rgb)]
    memory = aligned_zeros(call("scan_bytes", 600) // 4)
    call("scan_new", memory, *packed, 600, gap(wi) if lights else 0.0)
    light, view = (hemisphere(random_, 2000) for _ in range(2))
    rgb = np.zeros((2000, 4), np.float32)
    pair = [np.pad(np.float32(w), ((0, 0), (0, 1))) for w in (light, view)]
    call("scan_evaluate", memory, *pair, rgb, 2000)
    close = np.isclose(rgb[:, :3], scan.eval(light, view), rtol=1e-3, atol=1e-4).all(axis=1)
    assert close.mean() > 0.995  # the last of the neighbors may be another one
    assert (rgb[:, 3] == scan.valid(light, view)).mean() > 0.995
    assert 0.1 < rgb[:, 3].mean() < 1.0


def gap(wi: np.ndarray) -> float:
    """The longest way from one light to the next, in the plane of the normal."""
    lights = np.unique(np.round(np.stack([np.hypot(wi[:, 0], wi[:, 1]), wi[:, 2]], -1), 4), axis=0)
    apart = np.linalg.norm(lights[:, None] - lights, axis=2) + 9.0 * np.eye(len(lights))
    return float(apart.min(axis=1).max())


IN_NODE = """
const { Kernel } = of_kernel, read = require("fs").readFileSync;
const kernel = new Kernel(read(process.argv[2]));
const { blocks, weights, sizes, rates } = JSON.parse(read(0, "utf8"));
const put = (numbers, Type = Float32Array) => kernel.put(Type.from(numbers));
const net = kernel.network(sizes, true), count = blocks.length / (sizes[0] + 4) / 16;
const at = put(blocks), list = put(weights), order = put(Array(count).keys(), Int32Array);
kernel.network_list(net, list, 1, 0);
kernel.network_train(net, at, order, count, 32, put(rates), rates.length, 0);
kernel.network_list(net, list, 0, 0);
const normals = kernel.room(4000), loss = kernel.network_loss(net, at, 0, count);
kernel.random_normals(kernel.random(5), 1, normals, 1000);
const trained = kernel.numbers(list, weights.length), drawn = kernel.numbers(normals, 1000);
console.log(JSON.stringify([[...trained], loss, [...drawn]]));
"""


def test_webassembly_does_what_native_code_does(tmp_path):
    needs(None if shutil.which("node") else "node")
    samples = sampled(SHINY, 4096)
    layers = initial_layers((21, 21), 0, samples.inputs)
    rates = np.full(8, 1e-3, np.float32)
    (tmp_path / "kernel.wasm").write_bytes(kernel())
    (tmp_path / "run.js").write_text(f"{script('kernel')}\n{IN_NODE}")
    given = {
        "blocks": samples.blocks.tolist(),
        "weights": flat(layers).tolist(),
        "sizes": [6, 21, 21, 3],
        "rates": rates.tolist(),
    }
    command = ["node", str(tmp_path / "run.js"), str(tmp_path / "kernel.wasm")]
    made = subprocess.run(
        command, input=json.dumps(given), capture_output=True, text=True, check=True
    )
    weights, loss, normals = json.loads(made.stdout)
    native = NativeTrainer(layers, BATCH, SQUARED_RELU)
    native.epoch(samples, np.arange(samples.block_count), rates)
    np.testing.assert_array_equal(np.float32(weights), flat(native.layers()))
    assert loss == native.loss(samples)
    np.testing.assert_allclose(normals, np.random.default_rng(5).normal(size=1000), rtol=1e-6)


def test_the_kernel_is_what_its_sources_make(tmp_path):
    needs(None if importlib.util.find_spec("ziglang") else "ziglang")
    path = tmp_path / "kernel.wasm"
    subprocess.run([sys.executable, str(ROOT / "scripts" / "kernel.py"), str(path)], check=True)
    assert path.read_bytes() == (FOLDER / "kernel.wasm").read_bytes() == kernel()
    assert len(kernel()) < 60_000
