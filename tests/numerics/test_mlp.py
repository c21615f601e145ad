"""The forward pass of small networks: one result in every array library."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nacre.numerics.mlp import (
    RELU,
    SILU,
    SILU_BY_TANH,
    SQUARED_RELU,
    TANH,
    Layer,
    activate,
    dense,
    forward,
    widths,
)

ALL = (RELU, SQUARED_RELU, TANH, SILU, SILU_BY_TANH)


def made(*sizes: int) -> list[Layer]:
    random = np.random.default_rng(1)
    return [
        Layer(random.normal(size=(rows, columns)), random.normal(size=columns))
        for rows, columns in itertools.pairwise(sizes)
    ]


LAYERS = made(3, 5, 4, 2)
INPUTS = np.random.default_rng(2).normal(size=(7, 3)).astype(np.float32)


def expected(activation: str) -> np.ndarray:
    functions = {
        RELU: lambda x: np.where(x > 0.0, x, 0.0),
        SQUARED_RELU: lambda x: np.where(x > 0.0, x**2, 0.0),
        TANH: np.tanh,
        SILU: lambda x: x / (1.0 + np.exp(-x)),
        SILU_BY_TANH: lambda x: x / (1.0 + np.exp(-x)),
    }
    values = INPUTS.astype(np.float64)
    for index, layer in enumerate(LAYERS):
        values = values @ layer.weights.astype(np.float64) + layer.biases
        if index < 2:
            values = functions[activation](values)
    return values


@pytest.mark.parametrize("activation", ALL)
def test_rows_go_through_the_layers_in_their_own_precision(activation):
    single = forward(INPUTS, LAYERS, activation)
    double = forward(INPUTS.astype(np.float64), LAYERS, activation)
    assert (single.dtype, double.dtype) == (np.float32, np.float64)
    np.testing.assert_allclose(double, expected(activation), rtol=1e-12)
    np.testing.assert_allclose(single, expected(activation), rtol=2e-5, atol=2e-6)


@pytest.mark.parametrize("activation", [SILU, SILU_BY_TANH])
def test_activations_do_not_overflow(activation):
    layers = 2 * [Layer(np.eye(1), np.zeros(1))]
    values = np.array([[-1e3], [0.0], [1e3]], np.float32)
    found = forward(values, layers, activation)
    np.testing.assert_allclose(found, [[0.0], [0.0], [1e3]], atol=1e-6)


@pytest.mark.parametrize("activation", [RELU, SQUARED_RELU])
def test_components_are_what_rows_are(activation):
    found = forward(tuple(INPUTS.T), LAYERS, activation)
    assert isinstance(found, list)
    rows = forward(INPUTS, LAYERS, activation)
    np.testing.assert_allclose(np.stack(found, -1), rows, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("activation", ALL)
def test_a_layer_and_its_activation_can_be_taken_apart(activation):
    apart = activate(dense(INPUTS, LAYERS[0]), activation)
    np.testing.assert_array_equal(apart, dense(INPUTS, LAYERS[0], activation))


@pytest.mark.parametrize("activation", [RELU, SQUARED_RELU, TANH, SILU])
def test_tensors_have_gradients(activation):
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    layers = [tuple(torch.tensor(part, requires_grad=True) for part in y) for y in LAYERS]
    for shape in ((7, 3), (7, 1, 3)):
        found = forward(torch.from_numpy(INPUTS).reshape(shape), layers, activation)
        np.testing.assert_allclose(
            found.detach().numpy().reshape(7, 2), expected(activation), rtol=2e-5, atol=2e-6
        )
    found.sum().backward()
    assert all(part.grad is not None for layer in layers for part in layer)


def test_many_networks_at_once():
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    one, other = LAYERS[0], Layer(-LAYERS[0].weights, LAYERS[0].biases)
    stacked = tuple(torch.from_numpy(np.stack(parts)) for parts in zip(one, other, strict=True))
    found = dense(torch.from_numpy(np.stack([INPUTS, INPUTS])), stacked, RELU).numpy()
    for index, layer in enumerate((one, other)):
        np.testing.assert_allclose(found[index], dense(INPUTS, layer, RELU), rtol=1e-5, atol=1e-6)


def test_widths_are_of_layers_that_chain():
    assert widths(LAYERS) == (3, 5, 4, 2)
    with pytest.raises(ValueError, match="do not chain"):
        widths([LAYERS[0], LAYERS[2]])
    with pytest.raises(ValueError, match="at least one layer"):
        widths([])


def test_parameters_of_modules_are_tensors():
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    inputs = torch.nn.Parameter(torch.from_numpy(INPUTS))
    layers = [tuple(map(torch.from_numpy, layer)) for layer in LAYERS]
    found = forward(inputs, layers, RELU)
    np.testing.assert_allclose(found.detach(), expected(RELU), rtol=2e-5, atol=2e-6)


@pytest.mark.parametrize("activation", [RELU, SQUARED_RELU])
def test_arrays_of_drjit_are_activated_as_others(activation):
    drjit = pytest.importorskip("drjit", reason="needs the extra 'render'")
    found = activate(drjit.scalar.ArrayXf([-2.0, 0.0, 0.5, 3.0]), activation)
    expected = np.maximum([-2.0, 0.0, 0.5, 3.0], 0.0) ** (1 if activation == RELU else 2)
    np.testing.assert_allclose(np.array(found), expected)
