"""Several starts, and replicas that are averaged."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from nacre.neural import replicas
from nacre.neural.kernel import KernelTrainer
from nacre.neural.replicas import REPLICAS, ReplicaTrainer
from nacre.neural.samples import BLOCK
from nacre.neural.training import initial_layers
from tests.neural.test_trainers import flat, random_layers, random_samples

BATCH = 64
SIZES = (6, 9, 3)


def rates(count: int) -> np.ndarray:
    return np.linspace(2e-3, 1e-3, count).astype(np.float32)


def test_replicas_take_halves_of_an_epoch_and_meet_at_their_mean():
    samples, layers = random_samples(48 * BLOCK), random_layers(SIZES)
    order = np.random.default_rng(0).permutation(48)  # 12 batches of 4 blocks
    with ReplicaTrainer([layers], BATCH) as trainer:
        trainer.epoch(samples, order, rates(12))
    alone = [KernelTrainer(layers, BATCH) for _ in range(REPLICAS)]
    for k, one in enumerate(alone):
        one.epoch(samples, order[24 * k : 24 * (k + 1)], 2 * rates(12)[::2])
    mean = np.mean([flat(one.layers()) for one in alone], axis=0)
    np.testing.assert_allclose(flat(trainer.layers()), mean, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("blocks", [8 * 51, 8 * 51 + 3, 5, 1])
def test_any_number_of_batches_is_trained_on(blocks):
    samples, layers = random_samples(blocks * BLOCK), random_layers(SIZES)
    batches = -(-blocks // (BATCH // BLOCK))
    with ReplicaTrainer([layers], BATCH) as trainer:
        before = trainer.loss(samples)
        for _ in range(20):
            trainer.epoch(samples, np.arange(blocks), rates(batches))
        assert trainer.loss(samples) < before


def test_the_number_of_cores_changes_nothing(monkeypatch):
    samples, held_out = random_samples(200 * BLOCK), random_samples(40 * BLOCK, seed=1)
    found = []
    for cores in (1, 2, 7):
        monkeypatch.setattr(replicas, "free_cores", lambda cores=cores: cores)
        starts = [initial_layers((9,), 0, 6, start) for start in range(3)]
        with ReplicaTrainer(starts, BATCH, trial=1, held_out=held_out) as trainer:
            for _ in range(3):
                trainer.epoch(samples, np.arange(200), rates(50))
            found.append(flat(trainer.layers()))
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def stretches(monkeypatch, advance):
    """Weights of an epoch in which the other thread advances its replica in a way of its own."""
    samples, main = random_samples(200 * BLOCK), threading.current_thread()
    epoch = KernelTrainer.epoch

    def here_or_there(self, *arguments):
        if threading.current_thread() is not main:
            advance()
        epoch(self, *arguments)

    with monkeypatch.context() as patch:
        patch.setattr(replicas, "free_cores", lambda: 2)
        patch.setattr(replicas, "_STEPS", 3)
        patch.setattr(replicas, "_PIECE", 1)
        patch.setattr(KernelTrainer, "epoch", here_or_there)
        with ReplicaTrainer([initial_layers((9,), 0)], BATCH) as trainer:
            for _ in range(3):
                trainer.epoch(samples, np.arange(200), rates(50))
            return flat(trainer.layers())


def test_a_thread_that_is_held_up_changes_nothing_but_the_time(monkeypatch):
    expected = stretches(monkeypatch, lambda: None)
    random = np.random.default_rng(0)
    found = stretches(monkeypatch, lambda: time.sleep(random.choice([0.0, 2e-4, 2e-3, 0.05])))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.slow
def test_nobody_waits_for_a_thread_that_stands_still(monkeypatch):
    began = time.monotonic()
    stretches(monkeypatch, lambda: time.sleep(5.0))
    assert time.monotonic() - began < 9.0  # one sleep, for which closing waits


def test_an_error_of_the_other_thread_is_raised(monkeypatch):
    def fail():
        raise MemoryError

    monkeypatch.setattr(replicas, "_PATIENCE", 1e6)
    with pytest.raises(MemoryError):
        stretches(monkeypatch, fail)


def test_the_start_with_the_smallest_loss_goes_on():
    samples, held_out = random_samples(200 * BLOCK), random_samples(40 * BLOCK, seed=1)
    starts = [initial_layers((9,), 0, 6, start) for start in range(4)]
    assert len({flat(layers).tobytes() for layers in starts}) == 4
    losses = []
    for layers in starts:
        alone = KernelTrainer(layers, BATCH)
        alone.epoch(samples, np.arange(200), rates(50))
        losses.append(alone.loss(held_out))
    with ReplicaTrainer(starts, BATCH, trial=1, held_out=held_out) as trainer:
        trainer.epoch(samples, np.arange(200), rates(50))
        assert trainer.loss(held_out) == min(losses)


def test_a_start_that_is_lost_is_not_chosen():
    samples = random_samples(20 * BLOCK)
    lost = [type(layer)(layer.weights * np.nan, layer.biases) for layer in random_layers(SIZES)]
    starts = [lost, random_layers(SIZES), lost]
    with ReplicaTrainer(starts, BATCH, trial=1, held_out=samples) as trainer:
        trainer.epoch(samples, np.arange(20), rates(5))
        assert np.isfinite(trainer.loss(samples))
