"""The compiled kernel against autograd."""

from __future__ import annotations

import itertools
import os
import platform
import subprocess
import sys

import numpy as np
import pytest

from nacre.neural.kernel import KernelTrainer
from nacre.neural.nbrdf import ACTIVATIONS
from nacre.neural.samples import BLOCK, Samples
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer
from tests.tiers import tiered

torch = pytest.importorskip("torch", reason="needs the extra 'latent'")

SHAPES = [
    *((6, 21, 21, 3), (6, 12, 12, 3), (6, 32, 16, 8, 3), (6, 5, 3), (7, 13, 12, 3)),
    *((6, 12, 1), (6, 16, 10, 31)),
]
"""Those of a spectral network's coefficients have other outputs than three."""


def random_layers(sizes, seed=0, activation=RELU):
    scale = 0.5 if activation == SQUARED_RELU else 1.0  # squares grow from layer to layer
    random = np.random.default_rng(seed)
    return [
        Layer(
            (scale * random.normal(size=(a, b)) * np.sqrt(2 / a)).astype(np.float32),
            (random.normal(size=b) * 0.1).astype(np.float32),
        )
        for a, b in itertools.pairwise(sizes)
    ]


def random_samples(count, seed=0, heaviest=1.0, inputs=6, outputs=3):
    random = np.random.default_rng(seed)
    return Samples.pack(
        random.normal(size=(count, inputs)),
        random.exponential(size=(count, outputs)),
        random.uniform(0.01, heaviest, count),
    )


def flat(layers):
    return np.concatenate([p.ravel() for y in layers for p in (y.weights, y.biases)])


def autograd(layers, samples, order, activation=RELU, offset=1.0):
    """Loss and gradient in float64 PyTorch, written without the package's code."""
    count = samples.inputs
    rows = samples.blocks.reshape(-1, samples.rows, BLOCK)[order].transpose(0, 2, 1)
    rows = torch.tensor(rows.reshape(-1, samples.rows), dtype=torch.float64)
    parameters = [
        torch.tensor(p, dtype=torch.float64, requires_grad=True)
        for y in layers
        for p in (y.weights, y.biases)
    ]
    x = rows[:, :count]
    for k in range(0, len(parameters), 2):
        if k:
            x = x.clamp(min=0) ** (2 if activation == SQUARED_RELU else 1)
        x = x @ parameters[k] + parameters[k + 1]
    weight = rows[:, -1:]
    u = (torch.exp(x) - offset) * weight
    below = (u < 0) & (weight > 1)
    logarithm = torch.where(below, -torch.log1p(u.abs()), torch.log1p(u.where(~below, 0 * u)))
    loss = (logarithm - torch.log1p(rows[:, count:-1])).abs().mean()
    loss.backward()
    return float(loss.detach()), np.concatenate([p.grad.numpy().ravel() for p in parameters])


@pytest.mark.parametrize("sizes", SHAPES)
@pytest.mark.parametrize("count", [512, 480, 16])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_kernel_gradient_matches_autograd(sizes, count, activation):
    layers = random_layers(sizes, activation=activation)
    samples = random_samples(count, inputs=sizes[0], outputs=sizes[-1])
    order = np.random.default_rng(1).permutation(samples.block_count)
    loss, gradient = KernelTrainer(layers, 512, activation).gradient(samples, order)
    expected_loss, expected = autograd(layers, samples, order, activation)
    assert loss == pytest.approx(expected_loss, rel=1e-6)
    assert np.abs(flat(gradient) - expected).max() < 1e-5 * np.abs(expected).max()


OTHER_PROCESSOR = """
import sys
import llvmlite.binding
import numpy as np
has = sys.argv[1] == "avx2"
features = llvmlite.binding.FeatureMap(avx=has)
llvmlite.binding.get_host_cpu_features = lambda: features
from nacre.neural.kernel import KernelTrainer
from nacre.neural.nbrdf import ACTIVATIONS
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer
from nacre.array import aligned_zeros
from nacre.neural.samples import Samples
from nacre.neural.tiles import LANES
assert LANES == (8 if has else 4)
data = np.load(sys.argv[2])
parts = [data[f"arr_{k}"] for k in range(6)]
blocks = aligned_zeros(data["blocks"].size)
blocks[:] = data["blocks"]
layers = [Layer(w, b) for w, b in zip(parts[::2], parts[1::2])]
order = np.arange(blocks.size // 160)
loss, gradient = KernelTrainer(layers, 512).gradient(Samples(blocks, 6), order)
gradient = np.concatenate([p.ravel() for y in gradient for p in (y.weights, y.biases)])
np.savez(sys.argv[3], loss=loss, gradient=gradient)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "processor"),
    tiered([("avx2", "x86-64-v3"), ("none", "x86-64")], [("avx2", "x86-64-v3")]),
    ids=["8 lanes", "4 lanes"],
)
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names x86 processors")
def test_kernel_gradient_on_other_processors(kind, processor, tmp_path):
    """Narrower vectors, as of AVX2 and of SSE or NEON, from the same source."""
    layers, samples = random_layers(SHAPES[0]), random_samples(480)
    given, found = tmp_path / "given.npz", tmp_path / "found.npz"
    np.savez(given, *[p for y in layers for p in (y.weights, y.biases)], blocks=samples.blocks)
    environment = os.environ | {
        "NUMBA_CPU_NAME": processor,
        "NUMBA_CPU_FEATURES": "+avx2,+fma" if kind == "avx2" else "+sse2",
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    command = [sys.executable, "-c", OTHER_PROCESSOR, kind, given, found]
    subprocess.run(command, env=environment, check=True, timeout=120)
    expected_loss, expected = autograd(layers, samples, np.arange(samples.block_count))
    result = np.load(found)
    assert float(result["loss"]) == pytest.approx(expected_loss, rel=1e-6)
    assert np.abs(result["gradient"] - expected).max() < 1e-5 * np.abs(expected).max()


def test_positive_reflectances_that_fell_to_nothing_rise_again():
    samples = random_samples(4096, heaviest=32.0)
    *hidden, last = random_layers(SHAPES[0])
    trainer = KernelTrainer([*hidden, Layer(last.weights, last.biases - 30.0)], 512, offset=0.0)
    before = trainer.loss(samples)
    for _ in range(60):
        trainer.epoch(samples, np.arange(samples.block_count), np.full(8, 0.1, np.float32))
    assert trainer.loss(samples) < 0.6 * before


@pytest.mark.parametrize("heaviest", [1.0, 100.0])
def test_positive_reflectances_have_the_gradient_of_autograd(heaviest):
    layers, samples = random_layers(SHAPES[0]), random_samples(512, heaviest=heaviest)
    layers[-1] = Layer(0.5 * layers[-1].weights, layers[-1].biases)  # e^x above MIN_SLOPE
    order = np.arange(32)
    expected_loss, expected = autograd(layers, samples, order, offset=0.0)
    loss, gradient = KernelTrainer(layers, 512, offset=0.0).gradient(samples, order)
    assert loss == pytest.approx(expected_loss, rel=1e-6)
    assert np.abs(flat(gradient) - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("heaviest", [1.0, 100.0])
def test_weights_above_one_have_the_gradient_of_autograd(heaviest):
    layers, samples = random_layers(SHAPES[0]), random_samples(512, heaviest=heaviest)
    order = np.arange(32)
    expected_loss, expected = autograd(layers, samples, order)
    loss, gradient = KernelTrainer(layers, 512).gradient(samples, order)
    assert loss == pytest.approx(expected_loss, rel=1e-6)
    assert np.abs(flat(gradient) - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.slow
def test_adam_matches_torch_optim():
    layers, samples = random_layers(SHAPES[0]), random_samples(512)
    kernel = KernelTrainer(layers, 512)
    order = np.arange(32)
    parameters = torch.tensor(flat(layers), requires_grad=True)
    optimiser = torch.optim.Adam([parameters], lr=1e-2)
    for _ in range(3):
        parameters.grad = torch.tensor(flat(kernel.gradient(samples, order)[1]))
        optimiser.step()
        kernel.epoch(samples, order, np.array([1e-2], np.float32))
        np.testing.assert_allclose(flat(kernel.layers()), parameters.detach(), atol=2e-5)


def test_training_lowers_the_loss_and_leaves_padding_untouched():
    samples, layers = random_samples(16 * 640), random_layers((6, 10, 10, 3))
    kernel = KernelTrainer(layers, 512)
    before = kernel.loss(samples)
    for _ in range(5):
        kernel.epoch(samples, np.arange(640), np.full(20, 1e-2, np.float32))
    assert kernel.loss(samples) < 0.9 * before
    assert [y.weights.shape for y in kernel.layers()] == [(6, 10), (10, 10), (10, 3)]
    real = sum(y.weights.size + y.biases.size for y in layers)
    assert kernel._weights.size > real  # widths of 10 are padded to 12
    assert np.count_nonzero(kernel._weights) <= real


@pytest.mark.parametrize("batch", [0, 8, 24, -16])
def test_batches_that_are_no_multiple_of_a_block_are_refused(batch):
    with pytest.raises(ValueError, match="multiple of 16"):
        KernelTrainer(random_layers((6, 3, 3)), batch)


def test_samples_pack_and_split():
    samples = random_samples(100)
    assert samples.block_count == 7  # the last block repeats samples from the start
    shaped = samples.blocks.reshape(7, 10, BLOCK)
    np.testing.assert_array_equal(shaped[6, :, 4:], shaped[0, :, :12])
    training, held_out = samples.split(0.2)
    assert (training.block_count, held_out.block_count) == (6, 1)
    assert held_out.blocks.ctypes.data % 64 == 0
