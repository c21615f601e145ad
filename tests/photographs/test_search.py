"""What pictures say of a code, by pictures that are sums of a known material."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.brdf import Brdf
from nacre.latent import find_basis, pretrained_basis
from nacre.latent.sums import Sums
from nacre.neural import Layer, NeuralBrdf
from nacre.photographs.recording import Recording
from nacre.photographs.search import (
    Photograph,
    camera_factors,
    posterior_of_photographs,
    unexplained,
)
from nacre.photographs.weights import _Trained, refine

BASIS = pretrained_basis()
CODE = BASIS.examples[40].astype(float)
PIXELS, DIRECTIONS = 40, 48


def photograph(seed: int, factor: Any = 1.0, pixels: int = PIXELS) -> Photograph:
    """Pixels that see the material of CODE from one view each, in light from all around."""
    random = np.random.default_rng(seed)
    wi = random.normal(size=(pixels, DIRECTIONS, 3))
    wo = np.repeat(random.normal(size=(pixels, 1, 3)), DIRECTIONS, axis=1)
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True) for w in (wi, wo))
    wi[..., 2], wo[..., 2] = abs(wi[..., 2]), abs(wo[..., 2])
    light = random.exponential(size=wi.shape) ** 2
    weights = light * wi[..., 2:] * 2.0 * np.pi / DIRECTIONS
    f_r = BASIS.decode(CODE).eval(wi.reshape(-1, 3), wo.reshape(-1, 3)).reshape(wi.shape)
    values = (f_r * weights).sum(axis=1) * factor
    rays = (a.astype(np.float32) for a in (wi, wo, weights))
    shown = np.stack([np.arange(pixels), np.zeros(pixels, int)], axis=1)
    return Photograph(values, Recording(shown, *rays), 0.02 * values)


def test_sums_are_those_of_the_material_and_derivatives_those_of_differences():
    seen = photograph(1)
    recording = seen.recording
    sums = Sums(BASIS, recording.wi, recording.wo, recording.weights)
    values, slopes = sums.at(CODE)
    np.testing.assert_array_equal(sums.values(CODE), values)
    np.testing.assert_allclose(values, seen.values, rtol=1e-3)
    assert slopes.shape == (BASIS.code_dim, PIXELS, 3)
    for index in range(BASIS.code_dim):
        step = 0.02 * np.eye(BASIS.code_dim)[index]
        difference = (sums.at(CODE + step)[0] - sums.at(CODE - step)[0]) / 0.04
        np.testing.assert_allclose(slopes[index], difference, rtol=0.02, atol=2e-3 * values.max())


def test_a_code_is_found_that_explains_the_pictures():
    pictures = [photograph(1), photograph(2)]
    found = posterior_of_photographs(BASIS, pictures)
    factors = camera_factors(found, 2, "known")
    np.testing.assert_array_equal(factors, np.ones((2, 3)))
    assert unexplained(BASIS, found.code, pictures, factors) < 0.03
    assert unexplained(BASIS, np.zeros(BASIS.code_dim), pictures, factors) > 0.2


@pytest.mark.parametrize(
    ("camera", "factor"), [("exposure", [1.3, 1.3, 1.3]), ("white-balance", [1.3, 1.0, 0.8])]
)
def test_cameras_that_differ_are_told_apart(camera, factor):
    pictures = [photograph(1, factor), photograph(2)]
    found = posterior_of_photographs(BASIS, pictures, camera)
    factors = camera_factors(found, 2, camera)
    np.testing.assert_allclose(factors[0] / factors[1], factor, rtol=0.06)
    # How bright both are together, the prior of materials alone can tell.
    assert np.abs(np.log(factors)).max() < 0.6
    free = unexplained(BASIS, found.code, pictures, factors)
    known = posterior_of_photographs(BASIS, pictures)
    assert free < 0.5 * unexplained(BASIS, known.code, pictures, np.ones((2, 3)))


def test_more_pictures_and_cameras_that_are_known_make_it_more_certain():
    spreads = []
    for count, camera in ((1, "white-balance"), (1, "known"), (4, "known")):
        pictures = [photograph(seed, pixels=8) for seed in range(count)]
        codes = posterior_of_photographs(BASIS, pictures, camera).draw(400)
        spreads.append(float(np.linalg.norm(codes.std(axis=0))))
    assert spreads[0] > spreads[1] > 1.1 * spreads[2]


def test_pixels_that_no_material_explains_hardly_count():
    clean = photograph(1)
    values = clean.values.copy()
    values[:3] *= 30.0  # as of dust on a lens in the sun
    spoiled = Photograph(values, clean.recording, clean.noise)
    found = posterior_of_photographs(BASIS, [spoiled])
    assert unexplained(BASIS, found.code, [clean], np.ones((1, 3))) < 0.1


def test_weights_are_drawn_to_the_pictures():
    network = find_basis("hypernetwork").decode(CODE, "seven")
    assert isinstance(network, NeuralBrdf)
    tint = np.array([1.4, 1.0, 0.75])
    pictures = [photograph(1, tint), photograph(2, tint)]
    others = [BASIS.decode(CODE + np.eye(BASIS.code_dim)[k]) for k in range(6)]
    refined = refine(network, others, pictures, np.ones((2, 3)))

    def missed(material: Brdf, seen: Photograph) -> float:
        shape = seen.recording.wi.shape
        pairs = (w.reshape(-1, 3) for w in (seen.recording.wi, seen.recording.wo))
        values = (material.eval(*pairs).reshape(shape) * seen.recording.weights).sum(axis=1)
        return float(np.median(np.abs(np.log(values / seen.values))))

    unseen = photograph(3, tint)
    assert missed(network, unseen) > 0.2
    assert missed(refined, unseen) < 0.08


@pytest.mark.parametrize("activation", ["relu", "squared relu"])
@pytest.mark.parametrize("inputs", ["enhanced", "reciprocal"])
def test_derivatives_by_weights_are_those_of_differences(activation: str, inputs: str) -> None:
    random = np.random.default_rng(5)
    layers = [
        Layer(random.normal(0.0, 0.4, shape), random.normal(0.0, 0.2, shape[1]))
        for shape in ((6, 8), (8, 8), (8, 3))
    ]
    made = _Trained(NeuralBrdf(layers, inputs=inputs, activation=activation))
    seen = photograph(4, pixels=6).recording
    pairs, slopes = made.pairs(seen.wi, seen.wo), random.random((6, DIRECTIONS, 3))

    def total() -> float:
        return float((made.values(pairs).astype(np.float64) * slopes).sum())

    total()
    found = made.gradient(slopes.astype(np.float32))
    for parameter, gradient in zip(made.parameters, found, strict=True):
        assert gradient.shape == parameter.shape
        way = random.normal(size=parameter.shape).astype(np.float32)
        start = parameter.copy()
        ends = []
        for step in (1e-3, -1e-3):
            parameter[:] = start + np.float32(step) * way
            ends.append(total())
        parameter[:] = start
        expected = (ends[0] - ends[1]) / 2e-3
        scale = float(np.abs(gradient * way).sum())
        assert float((gradient * way).sum()) == pytest.approx(expected, abs=0.01 * scale)
