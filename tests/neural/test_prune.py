"""Units that are never active go; the reflectance stays."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre.geometry import from_spherical, join
from nacre.neural import Layer, NeuralBrdf
from nacre.neural.prune import without_inactive_units
from tests.data import require_data
from tests.measured.support import hemisphere


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(11)
    return hemisphere(random, count), hemisphere(random, count)


def grazing(random: np.random.Generator, count: int) -> np.ndarray:
    height, azimuth = 10.0 ** -random.uniform(1, 4, count), random.uniform(0, 2 * np.pi, count)
    return join(from_spherical(np.arccos(height), azimuth))


def network(biases: list[float], isotropic: bool = True) -> NeuralBrdf:
    random = np.random.default_rng(0)
    first = Layer(random.normal(0, 0.3, (6, len(biases))), np.array(biases))
    second = Layer(random.normal(0, 0.3, (len(biases), 5)), np.array([0.1, 0.2, -50.0, 0.1, 0.1]))
    return NeuralBrdf(
        [first, second, Layer(random.normal(0, 0.2, (5, 3)), np.full(3, 0.3))], isotropic=isotropic
    )


@pytest.mark.parametrize("isotropic", [True, False])
def test_only_inactive_units_go(isotropic):
    whole = network([0.5, -9.0, 0.1, 0.0, -8.0], isotropic)
    small = without_inactive_units(whole)
    assert small.sizes == (6, 3, 4, 3)
    np.testing.assert_allclose(small.eval(*pairs(20_000)), whole.eval(*pairs(20_000)), rtol=1e-5)


def test_units_that_only_grazing_light_and_view_reach_stay():
    random = np.random.default_rng(2)
    first = Layer(random.normal(0, 0.3, (6, 3)), np.zeros(3))
    # Of the paper's inputs, h and d, both heights are small only where all but touches the surface.
    first.weights[:, 1], first.biases[1] = [0, 0, -1, 0, 0, -1], 0.08
    whole = NeuralBrdf([first, Layer(random.normal(0, 2.0, (3, 3)), np.full(3, 0.3))])
    wi, wo = grazing(random, 20_000), grazing(random, 20_000)
    small = without_inactive_units(whole)
    np.testing.assert_allclose(small.eval(wi, wo), whole.eval(wi, wo), rtol=1e-6, atol=1e-9)


def test_a_layer_keeps_a_unit():
    whole = network([-9.0, -9.0])
    small = without_inactive_units(whole)
    assert small.sizes[1] == 1
    np.testing.assert_allclose(small.eval(*pairs(100)), whole.eval(*pairs(100)), rtol=1e-5)


@pytest.mark.parametrize("name", ["satin_rosaline_rgb", "acrylic_felt_white_rgb"])
def test_published_networks_stay_what_they_are(name):
    whole = nacre.load(require_data("pretrained", "rgl", f"{name}.h5"))
    small = without_inactive_units(whole)
    assert small.weight_count < whole.weight_count
    wi, wo = pairs(200_000)
    np.testing.assert_allclose(small.eval(wi, wo), whole.eval(wi, wo), rtol=1e-4, atol=1e-6)
