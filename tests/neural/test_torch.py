"""Stacks of networks in PyTorch against autograd, the compiled kernel, and each other."""

from __future__ import annotations

import contextlib
import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.neural.kernel import KernelTrainer
from nacre.neural.nbrdf import ACTIVATIONS
from nacre.neural.samples import draw
from nacre.neural.training import schedule
from tests.neural.test_trainers import autograd, flat, random_layers, random_samples
from tests.reflectances import Brushed, Glossy

torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.neural.torch import SampleStack, TorchTrainer  # noqa: E402  (needs PyTorch)

SHAPES = [(6, 21, 21, 3), (7, 12, 12, 3), (6, 32, 16, 8, 3), (6, 12, 1), (6, 16, 16, 10)]
"""The last have other outputs than three, as spectral networks do."""
BLOCKS = 100
BATCH = 512  # 32 blocks: three whole batches, and one of four


def different(materials, inputs=6, blocks=BLOCKS, outputs=3):
    """Samples of materials; weights of every second one go up to 100, as those of scans do."""
    return [
        random_samples(16 * blocks, seed, (1.0, 100.0)[seed % 2], inputs, outputs)
        for seed in range(materials)
    ]


def orders(materials, blocks=BLOCKS, seed=2):
    random = np.random.default_rng(seed)
    return np.array([random.permutation(blocks) for _ in range(materials)])


def rates(blocks=BLOCKS):
    return schedule(-(-16 * blocks // BATCH), 1e-3)


def test_stacks_of_positive_reflectances_have_the_losses_and_gradients_of_the_kernel():
    samples, layers = different(2), random_layers(SHAPES[0])
    stack, order = SampleStack(samples, "cpu"), np.arange(32)
    trainer = TorchTrainer(layers, BATCH, "cpu", 2, offset=0.0)
    losses, gradients = trainer.gradient(stack, np.array([order, order]))
    for m, part in enumerate(samples):
        kernel = KernelTrainer(layers, BATCH, offset=0.0)
        loss, expected = kernel.gradient(part, order)
        assert losses[m] == pytest.approx(loss, rel=1e-6)
        assert trainer.loss(stack)[m] == pytest.approx(kernel.loss(part), rel=1e-6)
        error = np.abs(flat(gradients[m]) - flat(expected)).max()
        assert error < 1e-5 * np.abs(flat(expected)).max()


@pytest.mark.parametrize("sizes", SHAPES)
@pytest.mark.parametrize("count", [32, 30, 1])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_every_gradient_of_a_stack_matches_autograd_and_the_kernel(sizes, count, activation):
    samples = different(3, inputs=sizes[0], outputs=sizes[-1])
    stack, order = SampleStack(samples, "cpu"), orders(3)
    trainer = TorchTrainer(random_layers(sizes, activation=activation), BATCH, "cpu", 3, activation)
    trainer.epoch(stack, order, rates())
    networks = trainer.layers()
    assert not np.array_equal(flat(networks[0]), flat(networks[1]))  # they are their own by now
    losses, gradients = trainer.gradient(stack, order[:, :count])
    for m, layers in enumerate(networks):
        expected_loss, expected = autograd(layers, samples[m], order[m, :count], activation)
        kernel = KernelTrainer(layers, BATCH, activation)
        kernel_loss, compiled = kernel.gradient(samples[m], order[m, :count])
        assert losses[m] == pytest.approx(expected_loss, rel=1e-6)
        assert losses[m] == pytest.approx(kernel_loss, rel=1e-6)
        for other in (expected, flat(compiled)):
            assert np.abs(flat(gradients[m]) - other).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("material", [Glossy(0.3, 0.05, 0.3), Brushed()])
def test_gradients_of_real_inputs_match_the_kernel(material):
    samples = [draw(material, 512, seed, inputs="enhanced", gain=32.0) for seed in range(2)]
    assert samples[0].inputs == (6 if material.isotropic else 8)
    layers = random_layers((samples[0].inputs, 21, 21, 3))
    losses, gradients = TorchTrainer(layers, BATCH, "cpu", 2).gradient(
        SampleStack(samples, "cpu"), np.arange(32)
    )
    for m in range(2):
        loss, expected = KernelTrainer(layers, BATCH).gradient(samples[m], np.arange(32))
        assert losses[m] == pytest.approx(loss, rel=1e-6)
        error = np.abs(flat(gradients[m]) - flat(expected)).max()
        assert error < 1e-5 * np.abs(flat(expected)).max()


@pytest.mark.parametrize("outputs", [3, 10])
def test_a_stack_takes_the_steps_of_the_kernel(outputs):
    samples, order = different(3, blocks=500, outputs=outputs), orders(3, 500)
    layers = random_layers((6, 16, 16, outputs))
    stack = SampleStack(samples, "cpu")
    trainer = TorchTrainer(layers, BATCH, "cpu", 3)
    kernels = [KernelTrainer(layers, BATCH) for _ in samples]
    for _ in range(3):
        trainer.epoch(stack, order, rates(500))
        for kernel, part, own in zip(kernels, samples, order, strict=True):
            kernel.epoch(part, own, rates(500))
        expected = [kernel.loss(part) for kernel, part in zip(kernels, samples, strict=True)]
        assert trainer.loss(stack) == pytest.approx(expected, rel=1e-4)
    for network, kernel in zip(trainer.layers(), kernels, strict=True):
        np.testing.assert_allclose(flat(network), flat(kernel.layers()), atol=2e-3)


def test_a_stack_is_as_many_stacks_of_one():
    samples, layers = different(4), random_layers(SHAPES[0])
    together = TorchTrainer(layers, BATCH, "cpu", 4)
    order = orders(1)[0]
    together.epoch(SampleStack(samples, "cpu"), order, rates())
    for m, part in enumerate(samples):
        alone = TorchTrainer(layers, BATCH, "cpu")
        alone.epoch(SampleStack([part], "cpu"), order, rates())
        np.testing.assert_allclose(
            flat(together.layers()[m]), flat(alone.layers()[0]), rtol=0, atol=1e-5
        )


def test_a_material_that_is_not_a_number_does_not_hurt_the_others():
    samples, layers = different(3), random_layers(SHAPES[0])
    results = []
    for _ in range(2):
        trainer = TorchTrainer(layers, BATCH, "cpu", 3)
        stack = SampleStack(samples, "cpu")
        trainer.epoch(stack, orders(3), rates())
        results.append((trainer.loss(stack), [flat(y) for y in trainer.layers()]))
        samples[1].blocks[:] = np.nan
    for healthy, spoilt in zip(*results, strict=True):
        assert not np.isfinite(spoilt[1]).any()
        for m in (0, 2):
            np.testing.assert_array_equal(healthy[m], spoilt[m])


def test_a_loss_is_over_all_samples_of_each_material():
    samples = [random_samples(16 * count, count) for count in (5, 70, 4100)]
    layers = random_layers(SHAPES[0])
    losses = TorchTrainer(layers, BATCH, "cpu", 3).loss(SampleStack(samples, "cpu"))
    expected = [KernelTrainer(layers, BATCH).loss(part) for part in samples]
    assert losses == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("batch", [0, 8, 24, -16])
def test_batches_that_are_no_multiple_of_a_block_are_refused(batch):
    with pytest.raises(ValueError, match="multiple of 16"):
        TorchTrainer(random_layers((6, 3, 3)), batch, "cpu")


def test_a_gradient_of_more_than_a_batch_is_refused():
    trainer = TorchTrainer(random_layers((6, 3, 3)), 16, "cpu")
    with pytest.raises(ValueError, match="2 blocks are more than one batch of 1"):
        trainer.gradient(SampleStack(different(1), "cpu"), np.arange(2))


def test_an_unknown_device_is_named():
    with pytest.raises(NacreError, match="'abacus'"):
        TorchTrainer(random_layers((6, 3, 3)), 16, "abacus")


def test_a_recorded_step_can_be_repeated(monkeypatch):
    """As on CUDA, where a recording reads and writes the memory that it was made with."""
    replayed = []

    def record(trainer, blocks):
        def replay():
            trainer._update(blocks)
            replayed.append(blocks.shape[1])

        return SimpleNamespace(replay=replay)

    monkeypatch.setattr(TorchTrainer, "_record", record)
    monkeypatch.setattr(torch.cuda, "stream", lambda stream: contextlib.nullcontext())
    stream = SimpleNamespace(wait_stream=lambda other: None)
    monkeypatch.setattr(torch.cuda, "current_stream", lambda device: stream)
    samples, layers = SampleStack(different(2), "cpu"), random_layers(SHAPES[0])
    plain, recorded = (TorchTrainer(layers, BATCH, "cpu", 2) for _ in range(2))
    recorded._stream = stream
    for order in (orders(2), orders(2, seed=3)):
        for trainer in (plain, recorded):
            trainer.epoch(samples, order, rates())
    assert replayed == [BATCH] * 3  # of six whole batches; three came before the recording
    for one, other in zip(plain.layers(), recorded.layers(), strict=True):
        np.testing.assert_array_equal(flat(one), flat(other))


@pytest.mark.skipif(not torch.cuda.is_available(), reason="PyTorch has no CUDA device here")
def test_recorded_steps_on_cuda_are_those_of_the_cpu():
    samples, order = different(5, blocks=500), orders(5, 500)
    layers = random_layers(SHAPES[0])
    trainers = {name: TorchTrainer(layers, BATCH, name, 5) for name in ("cpu", "cuda")}
    stacks = {name: SampleStack(samples, name) for name in trainers}
    for _, part in itertools.product(range(3), (order, order[0])):
        for name, trainer in trainers.items():
            trainer.epoch(stacks[name], part, rates(500))
        cpu, cuda = (trainer.loss(stacks[name]) for name, trainer in trainers.items())
        assert cuda == pytest.approx(cpu, rel=1e-4)
    assert trainers["cuda"]._graph is not None
    networks = zip(*(t.layers() for t in trainers.values()), strict=True)
    for one, other in networks:
        np.testing.assert_allclose(flat(one), flat(other), atol=2e-3)
