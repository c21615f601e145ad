"""Optimizes a network's weights to match photographs, beyond what a code can express."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.geometry import split, uniform_rusinkiewicz
from nacre.latent.posterior import UNEXPLAINED
from nacre.neural import NeuralBrdf
from nacre.neural.inputs import network_inputs
from nacre.neural.nbrdf import check_weights, round_layers
from nacre.numerics.mlp import SQUARED_RELU, Layer, dense
from nacre.photographs.search import BLACK, Photograph
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.progress import Progress, silent
from nacre.sampling import fit_lobes

STEPS = 200
_RATE = 4e-3
_PIXELS = 96  # per step
_PAIRS = 4096  # at which the network is held to plausible materials
_PIXEL_ERROR = 0.03  # of the logarithm, which no network explains
_HOLD = 0.02  # weight of a pair of directions relative to a pixel
_DARK = 1e-3  # added to f_r cos theta_i before logarithms
_LARGEST = 80.0  # bound of outputs: e^x of more is infinite in single precision

_Array: TypeAlias = npt.NDArray[np.float32]


def refine(
    network: NeuralBrdf,
    plausible: Sequence[Brdf],
    photographs: Sequence[Photograph],
    factors: npt.NDArray[np.float64],
    *,
    seed: int = 0,
    progress: Progress = silent,
) -> NeuralBrdf:
    """A network whose pictures match photographs.

    It starts from the network of the expected material. Where the photographs do not tell, f_r is
    held to equally plausible materials, more strongly where these agree. Camera factors have shape
    (photographs, 3).
    """
    wi, wo, expected, deviation = _held(plausible, seed)
    made, optimizer = _Trained(network), _Adam()
    held, cosine = made.pairs(wi, wo), wi[:, 2:]
    parts = [_Pixels(made, photograph) for photograph in photographs]
    random = np.random.default_rng((seed, 15))
    with one_blas_thread():
        for step in range(STEPS):
            index = step % len(parts)
            part = parts[index]
            chosen = random.integers(0, len(part.seen), _PIXELS)
            found = made.values([array[chosen] for array in part.pairs])
            scale = factors[index].astype(np.float32) * part.weights[chosen]
            shown = (found * scale).sum(axis=1) + part.black
            missed = (np.log(shown) - part.seen[chosen]) / _PIXEL_ERROR
            slope = missed / (1.0 + 0.5 * missed * missed) / (_PIXEL_ERROR * missed.size)  # Cauchy
            gradient = made.gradient((slope / shown)[:, None] * scale)

            lit = made.values(held) * cosine + _DARK
            off = (np.log(lit) - expected) / deviation
            slope = 2.0 * _HOLD * off / (deviation * off.size)
            more = made.gradient(slope / lit * cosine)
            gradient = [a + b for a, b in zip(gradient, more, strict=True)]
            rate = 0.5 * _RATE * (1.0 + np.cos(np.pi * step / STEPS))
            optimizer.step(made.parameters, gradient, rate)
            if step % 20 == 0:
                progress("refining", step, STEPS, "")
    progress("refining", STEPS, STEPS, "")
    refined = made.brdf()
    return refined.replaced(sampler=fit_lobes(refined))


class _Trained:
    """A network whose weights change: its values, and what they mean for each weight."""

    def __init__(self, network: NeuralBrdf) -> None:
        self._network, self._offset = network, 0.0 if network.physical else 1.0
        self.parameters = [array.copy() for layer in network.layers for array in layer]
        self._kept: tuple[Any, ...] = ()

    def pairs(self, wi: _Array, wo: _Array) -> list[_Array]:
        """Inputs of the network, shape (..., inputs), and whether both directions are above the
        horizon, (..., 1), for directions of shape (..., 3).
        """
        network, light, view = self._network, split(wi), split(wo)
        inputs = network_inputs(light, view, network.isotropic, network.inputs, network.angle)
        rows = np.stack(np.broadcast_arrays(*inputs), axis=-1).astype(np.float32)
        return [rows, ((light[2] > 0.0) & (view[2] > 0.0))[..., None]]

    def values(self, pairs: Sequence[_Array]) -> _Array:
        """f_r in 1/sr for what :meth:`pairs` returned, shape (..., 3)."""
        rows, above = pairs
        *hidden, last = self._layers()
        inputs = [rows.reshape(-1, rows.shape[-1])]
        for layer in hidden:
            inputs.append(dense(inputs[-1], layer, self._network.activation))
        e = np.exp(np.minimum(dense(inputs[-1], last), _LARGEST)).reshape(*rows.shape[:-1], 3)
        lit = above & (e > self._offset)
        self._kept = inputs, np.where(lit, e, 0.0)
        return np.where(lit, e - self._offset, 0.0).astype(np.float32)

    def gradient(self, slopes: _Array) -> list[_Array]:
        """Derivatives of a sum with respect to each of the parameters, of which `slopes` are those
        with respect to the last :meth:`values`.
        """
        inputs, exponential = self._kept
        behind = np.asarray(slopes * exponential, np.float32).reshape(-1, 3)
        found: list[_Array] = []
        for index in reversed(range(len(inputs))):
            x = inputs[index]
            found[:0] = [x.T @ behind, behind.sum(axis=0)]
            if index:
                behind = behind @ self.parameters[2 * index].T
                squared = self._network.activation == SQUARED_RELU
                behind = behind * (2.0 * np.sqrt(x) if squared else x > 0.0)
        return found

    def brdf(self) -> NeuralBrdf:
        """The network as it is now, without facts about its fit, which no longer hold."""
        check_weights(self._layers(), self._network.activation)
        layers = round_layers(self._layers(), self._network.precision)
        facts = self._network.metadata
        kept = {key: facts[key] for key in facts if key not in ("fit", "quality")}
        return self._network.with_layers(layers).replaced(metadata=kept)

    def _layers(self) -> list[Layer]:
        pairs = zip(self.parameters[::2], self.parameters[1::2], strict=True)
        return [Layer(weights, biases) for weights, biases in pairs]


class _Adam:
    """Kingma and Ba 2015, with the usual decays."""

    def __init__(self) -> None:
        self._means: list[_Array] = []
        self._squares: list[_Array] = []
        self._count = 0

    def step(self, parameters: list[_Array], gradient: list[_Array], rate: float) -> None:
        """Move the parameters, in place."""
        self._count += 1
        self._means = self._means or [np.zeros_like(p) for p in parameters]
        self._squares = self._squares or [np.zeros_like(p) for p in parameters]
        states = zip(parameters, gradient, self._means, self._squares, strict=True)
        for parameter, g, mean, square in states:
            mean += np.float32(0.1) * (g - mean)
            square += np.float32(0.001) * (g * g - square)
            spread = np.sqrt(square / np.float32(1.0 - 0.999**self._count)) + np.float32(1e-8)
            parameter -= np.float32(rate / (1.0 - 0.9**self._count)) * mean / spread


class _Pixels:
    """What one photograph shows.

    `pairs` are those of :meth:`_Trained.pairs`, `weights` of f_r at each, `seen` the logarithms of
    the pixels plus `black`.
    """

    def __init__(self, made: _Trained, photograph: Photograph) -> None:
        recording, values = photograph.recording, photograph.values
        self.black = np.float32(BLACK * float(values.mean()))
        self.seen = np.log(np.maximum(values, 0.0) + self.black).astype(np.float32)
        self.pairs, self.weights = made.pairs(recording.wi, recording.wo), recording.weights


def _held(plausible: Sequence[Brdf], seed: int) -> tuple[npt.NDArray[np.float32], ...]:
    """Pairs of directions, means and deviations of the logarithm of f cos theta_i there."""
    u = np.random.default_rng((seed, 14)).random((4, 4 * _PAIRS), dtype=np.float32)
    u[1] = 0.0
    wi, wo = (np.stack(np.broadcast_arrays(*w), axis=-1) for w in uniform_rusinkiewicz(u))
    above = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    wi, wo = wi[above][:_PAIRS], wo[above][:_PAIRS]
    values = np.stack([brdf.eval(wi, wo) for brdf in plausible]) * wi[:, 2:]
    logs = np.log(values + _DARK)
    deviation = np.hypot(logs.std(axis=0), UNEXPLAINED)
    return tuple(a.astype(np.float32) for a in (wi, wo, logs.mean(axis=0), deviation))
