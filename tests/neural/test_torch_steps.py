"""Stacks trained by the CUDA kernel, which g++ compiles here and a processor runs.

The card's registers, caches and clock are not in this: what is tested is what the kernel computes,
that no barrier is missing, and how Python compiles, launches and judges it.
"""

from __future__ import annotations

import shutil
import subprocess
import sys

import numpy as np
import pytest

from nacre.neural import Recipe, fit_many
from nacre.neural.kernel import KernelTrainer
from nacre.numerics.mlp import RELU, SQUARED_RELU, shaped_layers
from nacre.runtime import cuda_kernel
from nacre.runtime.cuda_kernel import Card, CudaError
from tests.neural.test_trainers import autograd, flat, random_layers
from tests.oracles.cuda import COMPILER, EmulatedCuda
from tests.reflectances import Glossy
from tests.tiers import tiered

torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.neural import torch_steps  # noqa: E402  (needs PyTorch)
from nacre.neural.torch import SampleStack, TorchTrainer  # noqa: E402
from nacre.neural.torch_steps import StepsTrainer  # noqa: E402
from tests.neural.test_torch import BATCH, different, orders, rates  # noqa: E402

emulated = pytest.mark.skipif(
    not COMPILER or sys.platform != "linux", reason="needs g++, and the contexts of Linux"
)
SIZES = 6, 21, 21, 3
H200 = {"capability": 90, "multiprocessors": 132, "shared": 227 << 10}
T4 = {"capability": 75, "multiprocessors": 40, "shared": 64 << 10}
TIGHT = {"capability": 90, "multiprocessors": 5, "shared": 40 << 10}

CASES = [
    (SIZES, SQUARED_RELU, 1.0, H200, (4, 128)),
    (SIZES, RELU, 1.0, T4, (1, 64)),
    ((7, 12, 4, 3), RELU, 0.0, TIGHT, (2, 128)),
    ((6, 32, 16, 8, 3), SQUARED_RELU, 1.0, TIGHT, (2, 32)),
    ((6, 16, 10), RELU, 1.0, H200, (4, 128)),
]
"""Widths, activation, offset, card, and the blocks per network and threads per block there."""


@pytest.fixture
def card(monkeypatch):
    """Makes a card of given properties the one that trainers find."""

    def found(**properties):
        emulation = EmulatedCuda(**properties)
        monkeypatch.setattr(cuda_kernel, "library", lambda: emulation)
        return emulation

    return found


def trained(kind, samples, layers, form=(RELU, 1.0), epochs=2):
    trainer = kind(layers, BATCH, "cpu", len(samples), *form)
    stack = SampleStack(samples, "cpu")
    for seed in range(epochs):
        trainer.epoch(stack, orders(len(samples), seed=seed), rates())
    return trainer


@emulated
@pytest.mark.parametrize(
    ("sizes", "activation", "offset", "properties", "launch"), tiered(CASES, CASES[:2])
)
def test_the_kernel_takes_the_steps_of_pytorch(card, sizes, activation, offset, properties, launch):
    found = card(**properties)
    samples = different(2, inputs=sizes[0], outputs=sizes[-1])
    layers, form = random_layers(sizes, activation=activation), (activation, offset)
    trainer = trained(StepsTrainer, samples, layers, form)
    assert found.launches == 3  # a trial, and an epoch each
    assert trainer._launch[:2] == launch
    assert trainer.steps == 8
    expected = trained(TorchTrainer, samples, layers, form)
    for one, other in zip(trainer.layers(), expected.layers(), strict=True):
        np.testing.assert_allclose(flat(one), flat(other), rtol=0, atol=2e-6)
    for mine, its in ((trainer._means, expected._means), (trainer._squares, expected._squares)):
        for one, other in zip(mine, its, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-3, atol=1e-6)


@emulated
def test_the_kernel_takes_the_steps_of_adam_in_double_precision(card):
    """Beside autograd and PyTorch's Adam of float64, none of which is the package's code."""
    card(**H200)
    (samples,), layers = different(1), random_layers(SIZES, activation=SQUARED_RELU)
    trainer = trained(StepsTrainer, [samples], layers, (SQUARED_RELU, 1.0), epochs=1)
    parameters = torch.tensor(flat(layers), dtype=torch.float64, requires_grad=True)
    adam = torch.optim.Adam([parameters])
    shapes = [layer.weights.shape for layer in layers]
    for step, rate in enumerate(rates()):
        order = orders(1, seed=0)[0][step * 32 : (step + 1) * 32]
        now = shaped_layers(parameters.detach().numpy(), shapes)
        parameters.grad = torch.from_numpy(autograd(now, samples, order, SQUARED_RELU)[1])
        adam.param_groups[0]["lr"] = float(rate)
        adam.step()
    np.testing.assert_allclose(flat(trainer.layers()[0]), parameters.detach(), rtol=0, atol=5e-6)


@emulated
def test_the_kernel_takes_the_steps_of_the_processor(card):
    card(**H200)
    samples, layers = different(2), random_layers(SIZES, activation=SQUARED_RELU)
    trainer = trained(StepsTrainer, samples, layers, (SQUARED_RELU, 1.0))
    losses = trainer.loss(SampleStack(samples, "cpu"))
    for m, part in enumerate(samples):
        kernel = KernelTrainer(layers, BATCH, SQUARED_RELU)
        for seed in range(2):
            kernel.epoch(part, orders(2, seed=seed)[m], rates())
        assert losses[m] == pytest.approx(kernel.loss(part), rel=1e-5)
        np.testing.assert_allclose(
            flat(trainer.layers()[m]), flat(kernel.layers()), rtol=0, atol=1e-4
        )


@emulated
def test_the_order_of_threads_does_not_matter_and_one_barrier_less_does(card, monkeypatch):
    samples, layers = different(1), random_layers(SIZES, activation=SQUARED_RELU)

    def weights(order):
        card(**H200, order=order)
        return flat(trained(StepsTrainer, samples, layers, (SQUARED_RELU, 1.0), 1).layers()[0])

    expected = weights(0)
    for order in (1, 2):
        np.testing.assert_array_equal(weights(order), expected)
    monkeypatch.setattr(StepsTrainer, "_try", lambda *_: None)
    _without("    __syncthreads();\n    if constexpr (L + 1 < LAYERS) forward", monkeypatch)
    assert not np.array_equal(weights(1), weights(2))


def _without(barrier, monkeypatch):
    """Compile `steps.cu` without a barrier from now on."""
    compiled = cuda_kernel.compiled

    def compiled_without(source, *card):
        assert source.count(barrier) == 1
        return compiled(source.replace(barrier, barrier.replace("__syncthreads();", "")), *card)

    monkeypatch.setattr(cuda_kernel, "compiled", compiled_without)


@emulated
def test_all_materials_may_share_an_order_and_one_that_is_not_a_number_does_not_hurt(card):
    card(**H200)
    samples, layers = different(2), random_layers(SIZES, activation=SQUARED_RELU)
    results = []
    for _ in range(2):
        trainer = StepsTrainer(layers, BATCH, "cpu", 2, SQUARED_RELU)
        trainer.epoch(SampleStack(samples, "cpu"), orders(1)[0], rates())
        results.append([flat(each) for each in trainer.layers()])
        samples[1].blocks[:] = np.nan
    np.testing.assert_array_equal(results[0][0], results[1][0])
    assert not np.isfinite(results[1][1]).any()
    expected = TorchTrainer(layers, BATCH, "cpu", 1, SQUARED_RELU)
    expected.epoch(SampleStack(samples[:1], "cpu"), orders(1)[0], rates())
    np.testing.assert_allclose(results[0][0], flat(expected.layers()[0]), rtol=0, atol=2e-6)


@pytest.mark.slow
@emulated
def test_a_fit_on_a_card_is_that_of_the_processor(card, monkeypatch):
    found, recipe = card(**H200), Recipe(epochs=3, samples=20_000)
    materials = [Glossy(0.1, 0.3, 0.2 + 0.1 * k).replaced(name=f"metal {k}") for k in range(2)]
    expected = dict(fit_many(materials, recipe, device="cpu"))
    monkeypatch.setattr(torch_steps, "stack_trainer", StepsTrainer)
    for index, network in fit_many(materials, recipe, device="cpu"):
        quality = expected[index].metadata["quality"]
        assert network.metadata["quality"] == pytest.approx(quality, rel=1e-3)
    assert found.launches == 4


def gives_up(layers, why):
    """Whether a trainer warns, and then takes the steps of PyTorch."""
    samples = different(2)
    with pytest.warns(RuntimeWarning, match=f"'cpu': each step is launched by itself.*{why}"):
        trainer = trained(StepsTrainer, samples, layers)
    expected = trained(TorchTrainer, samples, layers)
    return all(
        np.allclose(flat(one), flat(other), rtol=0, atol=1e-6)
        for one, other in zip(trainer.layers(), expected.layers(), strict=True)
    )


def test_without_the_libraries_of_cuda_steps_are_those_of_pytorch():
    assert not torch.version.cuda or pytest.skip("PyTorch has CUDA here")
    assert gives_up(random_layers(SIZES), "libcaffe2_nvrtc.so does not load")


def test_a_network_too_large_for_the_card_takes_the_steps_of_pytorch(card):
    card(capability=75, multiprocessors=40, shared=16 << 10)
    assert gives_up(random_layers(SIZES), "6-21-21-3 units does not fit .* of 16384 bytes")


@emulated
def test_a_source_that_does_not_compile_is_said_in_the_compilers_words(card, monkeypatch):
    found = card(**T4)
    compiled = cuda_kernel.compiled
    monkeypatch.setattr(cuda_kernel, "compiled", lambda source, *card: compiled("oops", *card))
    assert gives_up(random_layers(SIZES), "NVRTC: .*oops")
    assert found.options[0] == b"--gpu-architecture=sm_75"


@pytest.mark.slow
@emulated
def test_a_kernel_whose_first_gradient_is_wrong_is_given_up(card, monkeypatch):
    card(**T4)
    compiled = cuda_kernel.compiled

    def wrong(source, *card):
        return compiled(source.replace("1.0f / (OUTPUTS", "1.1f / (OUTPUTS"), *card)

    monkeypatch.setattr(cuda_kernel, "compiled", wrong)
    assert gives_up(random_layers(SIZES), "the kernel's gradient is off by")


@emulated
def test_a_launch_that_the_driver_refuses_is_no_end_of_the_fit(card, monkeypatch):
    found = card(**T4)
    monkeypatch.setattr(found, "cuLaunchKernel", lambda *_: 701, raising=False)
    assert gives_up(random_layers(SIZES), r"CUDA: emulated \(701\)")


@pytest.mark.parametrize(
    ("materials", "batch", "properties", "parts", "threads"),
    [
        (1, 512, H200, 4, 128),
        (33, 512, H200, 4, 128),
        (34, 512, H200, 2, 256),
        (128, 512, H200, 1, 256),
        (8, 256, H200, 2, 128),
        (8, 16, H200, 1, 32),
        (8, 512, {**H200, "capability": 80, "shared": 163 << 10}, 1, 256),
        (8, 512, T4, 1, 64),
    ],
)
def test_a_stack_is_spread_over_the_card(materials, batch, properties, parts, threads):
    launch = torch_steps._launch(SIZES, batch // 16, materials, Card(EmulatedCuda(**properties)))
    assert launch[:2] == (parts, threads)
    assert launch.shared <= properties["shared"]


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("nvcc"), reason="needs NVIDIA's compiler")
@pytest.mark.parametrize("capability", [75, 90, 120])
def test_nvidias_compiler_takes_the_source(capability, card, tmp_path, monkeypatch):
    """For cards of three generations; NVRTC and nvcc are one compiler."""
    made = tmp_path / "kernel.cubin"

    def compiled(source, capability, functions):
        given = tmp_path / "kernel.cu"
        given.write_text(source)
        command = ["nvcc", "-std=c++17", "-cubin", f"-arch=sm_{capability}", "-Xptxas=-v"]
        result = subprocess.run(
            [*command, given, "-o", made], check=True, capture_output=True, text=True
        )
        assert "used 1 barriers" in result.stderr
        raise CudaError("compiled only")

    monkeypatch.setattr(cuda_kernel, "compiled", compiled)
    card(**{**H200, "capability": capability, "shared": 64 << 10})
    with pytest.warns(RuntimeWarning, match="compiled only"):
        StepsTrainer(random_layers(SIZES), BATCH, "cpu", 2)
    assert made.stat().st_size > 10_000


@pytest.mark.skipif(not torch.cuda.is_available(), reason="PyTorch has no CUDA device here")
def test_steps_on_a_card_are_those_of_the_processor():
    samples, layers = different(9), random_layers(SIZES, activation=SQUARED_RELU)
    trainer = StepsTrainer(layers, BATCH, "cuda", len(samples), SQUARED_RELU)
    for seed in range(2):
        trainer.epoch(SampleStack(samples, "cuda"), orders(len(samples), seed=seed), rates())
    assert trainer._kernel
    expected = trained(TorchTrainer, samples, layers, (SQUARED_RELU, 1.0))
    for one, other in zip(trainer.layers(), expected.layers(), strict=True):
        np.testing.assert_allclose(flat(one), flat(other), rtol=0, atol=1e-4)
