"""Networks without the units that are never active, for faster rendering."""

from __future__ import annotations

import numpy as np

from nacre.array import Components, Weights
from nacre.geometry import cosine_hemisphere, from_spherical, join, split, uniform_rusinkiewicz
from nacre.neural.inputs import network_inputs
from nacre.neural.nbrdf import NeuralBrdf
from nacre.numerics.mlp import Layer, activate, dense

_PAIRS = 1 << 16
_MARGIN = 0.02  # part of its range by which a unit must stay below zero to count as never active


def without_inactive_units(network: NeuralBrdf) -> NeuralBrdf:
    """The same reflectance from fewer weights.

    A hidden unit is left out if the input of its activation is negative, with a margin, at each of
    2^16 pairs of directions uniform in the Rusinkiewicz angles, as many that follow the cosine and
    as many near the horizon. Training leaves a few such units in most networks.
    """
    random = np.random.default_rng(0)
    pairs = [uniform_rusinkiewicz(random.random((4, _PAIRS), np.float32))]
    v = random.random((4, _PAIRS), np.float32)
    pairs.append((cosine_hemisphere(v[0], v[1]), cosine_hemisphere(v[2], v[3])))
    u = random.random((4, _PAIRS), np.float32)
    pairs.append((_near_horizon(u[0], u[1]), _near_horizon(u[2], u[3])))
    wi, wo = (np.concatenate([join(pair[side]) for pair in pairs]) for side in (0, 1))
    visible = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    light, view = (split(w[visible]) for w in (wi, wo))
    inputs = network_inputs(light, view, network.isotropic, network.inputs, network.angle)
    values = np.stack(np.broadcast_arrays(*inputs), axis=-1, dtype=np.float32)
    layers = list(network.layers)
    for index, layer in enumerate(network.layers[:-1]):
        values = dense(values, layer)
        low, high = values.min(axis=0), values.max(axis=0)
        kept = high > -_MARGIN * (high - low)
        kept[0] |= not kept.any()  # a layer keeps a unit
        here, after = layers[index], layers[index + 1]
        layers[index] = Layer(here.weights[:, kept], here.biases[kept])
        layers[index + 1] = Layer(after.weights[kept], after.biases)
        values = activate(values, network.activation)
    return network.with_layers(layers)


def _near_horizon(u: Weights, v: Weights) -> Components:
    """Directions whose cosines are uniform in their logarithm, from 1 down to 10^-4."""
    return from_spherical(np.arccos(np.float32(1e-4) ** u), np.float32(2.0 * np.pi) * v)
