"""The set encoder: sets have no order, both libraries agree, and training learns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.errors import NacreError
from nacre.latent.directions import shared_directions
from nacre.measured.merl import Resolution
from nacre.measured.merl_table import MerlBrdf
from nacre.numerics.direction_samples import DirectionSamples
from nacre_lab.sparse import set_encoder_training as training
from nacre_lab.sparse.set_encoder import SetEncoder, absolute, generated, relative, shapes

torch = pytest.importorskip("torch")


def lambert(*albedo):
    return Ggx(diffuse=albedo, specular=(0.0, 0.0, 0.0), roughness=0.5)


def counted(layers):
    return sum((n + 1) * m for n, m in layers)


@pytest.fixture(scope="module")
def encoder():
    first, hyper = shapes()
    count = counted(first) + sum(map(counted, hyper))
    weights = np.random.default_rng(3).normal(0.0, 0.1, count).astype(np.float32)
    return SetEncoder.from_weights(weights, MerlBrdf(np.full((3, 5, 5, 5), 200.0, np.float32)))


@pytest.fixture(scope="module")
def samples():
    wi, wo = shared_directions(24, 1)
    rgb = np.random.default_rng(2).random((24, 3)).astype(np.float32)
    return DirectionSamples(wi, wo, rgb)


def test_samples_have_no_order(encoder, samples):
    code = encoder.encode(samples)
    turned = encoder.encode(samples[np.random.default_rng(5).permutation(24)])
    assert code.shape == (40,)
    assert np.ptp(code) > 0.01
    np.testing.assert_allclose(turned, code, rtol=1e-5, atol=1e-7)


def test_sets_have_any_size(encoder, samples):
    for count in (1, 7, 24):
        f_r = encoder.decode(encoder.encode(samples[np.arange(count)])).eval(samples.wi, samples.wo)
        assert f_r.shape == (24, 3)
        assert (f_r >= 0.0).all()
    twice = samples[np.tile(np.arange(7), 2)]
    np.testing.assert_allclose(
        encoder.encode(twice), encoder.encode(samples[np.arange(7)]), rtol=1e-5, atol=1e-7
    )
    with pytest.raises(ValueError, match="one sample or more"):
        encoder.encode(samples[np.arange(0)])


def test_relative_values_are_the_logarithm_and_back():
    f_r, reference = np.float32([[0.0, 0.1, 30.0]]), np.float32([[0.05, 0.0, 1.0]])
    values = relative(f_r, reference)
    assert values[0, 1] == pytest.approx(np.log(1.0 + 0.102 / 0.002))
    np.testing.assert_allclose(absolute(values, reference), f_r, rtol=1e-4, atol=1e-6)


def test_generated_networks_are_the_same_in_both_libraries(encoder):
    codes = np.random.default_rng(4).random((2, 40)).astype(np.float32)
    tensors = [
        [tuple(torch.from_numpy(part) for part in layer) for layer in each]
        for each in encoder.hyper
    ]
    for one, other in zip(
        generated(codes, encoder.hyper), generated(torch.from_numpy(codes), tensors), strict=True
    ):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_allclose(a, b.numpy(), rtol=1e-4, atol=1e-5)


def test_the_median_is_that_of_the_materials():
    materials = [lambert(x, x, x) for x in (0.1, 0.3, 0.9)]
    wi, wo = shared_directions(16, 2)
    found = training.MedianBrdf(materials).eval(wi, wo)
    np.testing.assert_allclose(found, materials[1].eval(wi, wo), rtol=1e-5)


@pytest.mark.slow
def test_training_learns_and_goes_on_where_it_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(training, "RESOLUTION", Resolution(9, 9, 9))
    materials = [lambert(x, 0.2, 0.1) for x in (0.1, 0.9)]
    recipe = replace(training.RECIPE, steps=60, directions=512, batch=32, learning_rate=1e-3)
    seen = []

    def report(stage, done, total, text):
        seen.append((stage, done, text))
        if stage == "training" and stop and done == 50:
            raise KeyboardInterrupt

    stop = True
    with pytest.raises(KeyboardInterrupt):
        training.train(materials, recipe, tmp_path / "state", report)
    stop = False
    weights, median = training.train(materials, recipe, tmp_path / "state", report)
    whole, _ = training.train(materials, recipe, None, report)
    np.testing.assert_array_equal(weights, whole)
    encoder = SetEncoder.from_weights(weights, median)
    wi, wo = shared_directions(64, 9)
    f_r = materials[0].eval(wi, wo)
    made = encoder.decode(encoder.encode(DirectionSamples(wi, wo, f_r))).eval(wi, wo)
    blind = median.eval(wi, wo)
    missed, before = (np.median(np.abs(values - f_r)[:, 0]) for values in (made, blind))
    assert missed < 0.3 * before
    with pytest.raises(NacreError, match="two materials"):
        training.train(materials[:1], recipe, None, report)
