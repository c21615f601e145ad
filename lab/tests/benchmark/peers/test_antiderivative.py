"""A network whose derivative is f_r: reciprocal to the last bit, with the albedo of quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra 'torch'")

from nacre.array import Components, Floats  # noqa: E402
from nacre.errors import NacreError  # noqa: E402
from nacre.geometry import uniform_hemisphere  # noqa: E402
from nacre.neural.training import initial_layers  # noqa: E402
from nacre_lab.benchmark.peers.antiderivative import (  # noqa: E402
    AlbedoTerm,
    PassiveNetwork,
    Training,
    derivative,
    features,
    fit_antiderivative,
    stacked,
)
from nacre_lab.benchmark.peers.jets import ALL  # noqa: E402
from tests.oracles.reflectances import Glossy  # noqa: E402

SHORT = Training(hidden=(8, 8), steps=40, batch=256, samples=4000, learning_rate=1e-2)


@pytest.fixture(scope="module")
def network() -> PassiveNetwork:
    layers = initial_layers((5, 4), 3, 6)
    layers[-1].biases[:] = 0.2, 0.3, 0.4
    return PassiveNetwork(layers, "made")


def _direction(u: Floats, phi: Floats) -> Components:
    return np.sqrt(u) * np.cos(phi), np.sqrt(u) * np.sin(phi), np.sqrt(1.0 - u)


@pytest.mark.parametrize("cosine", [0.8, 0.5, 0.1])
def test_the_analytic_albedo_is_that_of_quadrature(network: PassiveNetwork, cosine: float) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(160)
    u, phi = np.meshgrid(0.5 * nodes + 0.5, 0.5 * math.pi * (nodes + 1.0), indexing="ij")
    view = _direction(np.full_like(u, 1.0 - cosine**2), 0.0 * u)
    f_r = network.eval_components(_direction(u, phi), view)
    # f cos(theta) over solid angle is f du / 2 dphi, here over half of the azimuths.
    area = 0.25 * math.pi * weights[:, None] * weights
    expected = [float((channel * area).sum()) for channel in f_r]
    np.testing.assert_allclose(network.analytic_albedo(np.array([cosine]))[0], expected, rtol=1e-7)


def test_light_and_view_are_swapped_to_the_same_bits(network: PassiveNetwork) -> None:
    u = np.random.default_rng(0).random((2, 4096, 2))
    wi, wo = (np.stack(uniform_hemisphere(*pair.T), -1).astype(np.float32) for pair in u)
    np.testing.assert_array_equal(network.eval(wi, wo), network.eval(wo, wi))


def test_tensors_and_components_are_the_same_network(network: PassiveNetwork) -> None:
    u = np.random.default_rng(1).random((3, 64)) * 0.9 + 0.05
    phi = math.pi * u[2]
    low, high = np.minimum(u[0], u[1]), np.maximum(u[0], u[1])
    parameters = [torch.from_numpy(np.float64(p)) for layer in network.layers for p in layer]
    thirds = derivative(stacked(features(low, high, phi)), parameters, ALL)
    found = thirds @ parameters[-2] + parameters[-1]
    expected = network.eval_components(_direction(low, 0.0 * phi), _direction(high, phi))
    np.testing.assert_allclose(found, np.stack(expected, -1), rtol=1e-6, atol=1e-9)


def test_gradients_of_the_albedo_are_those_of_differences(network: PassiveNetwork) -> None:
    term = AlbedoTerm(np.array([0.1, 0.6]))
    parameters = [
        torch.from_numpy(np.float64(p)).requires_grad_() for layer in network.layers for p in layer
    ]
    assert torch.autograd.gradcheck(lambda *p: term.albedo(p), parameters)


def test_a_fit_is_passive_where_the_material_is_not() -> None:
    bright = Glossy(1.1, 0.1, 0.4)
    found = fit_antiderivative(bright, SHORT)
    assert 0.5 < found.analytic_albedo(np.linspace(0.0, 1.0, 301)).max() < 1.0
    assert found.nbytes == 2 * (6 * 8 + 8 + 8 * 8 + 8 + 8 * 3 + 3)


def test_anisotropic_materials_are_refused() -> None:
    with pytest.raises(NacreError, match="is for isotropic materials"):
        fit_antiderivative(Glossy(0.1, 0.3, 0.15, 0.5), SHORT)
