"""The CPU fit kernel: forward, backward and Adam over an epoch in one compiled loop.

A mini-batch is gathered block by block into feature-major matrices that stay in the cache, pushed
through the layers in register tiles (:mod:`nacre.neural.simd`), and its gradient goes straight
into Adam. The kernel releases the interpreter lock, so materials fit in parallel on threads.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from nacre.neural.nbrdf import Layer
from nacre.neural.samples import BLOCK, Samples, aligned
from nacre.neural.simd import (
    DENSE_ROWS,
    OUTER_ROWS,
    OUTER_SIZE,
    PANEL,
    copy_block,
    dense_gate,
    dense_linear,
    dense_relu,
    outer,
    prefer_wide_vectors,
    prefetch_block,
)

_OUTPUTS = 3
_TARGETS = _OUTPUTS + 1
"""Rows after the inputs in a block of samples: three targets and the cosine."""

_compile = numba.njit(nogil=True, cache=True, error_model="numpy")
_compile_fast = numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=True)

Vector = npt.NDArray[np.float32]


@numba.njit(inline="always", error_model="numpy")  # type: ignore[untyped-decorator]
def _exp(x: Any) -> Any:
    """e^x to 2 ulp, coefficients from Cephes; vectorises, unlike the library's."""
    x = min(max(x, np.float32(-87.0)), np.float32(88.0))
    n = np.floor(x * np.float32(1.4426950408889634) + np.float32(0.5))
    r = (x - n * np.float32(0.693359375)) + n * np.float32(2.12194440e-4)
    p = np.float32(1.9875691500e-4)
    p = p * r + np.float32(1.3981999507e-3)
    p = p * r + np.float32(8.3334519073e-3)
    p = p * r + np.float32(4.1665795894e-2)
    p = p * r + np.float32(1.6666665459e-1)
    p = p * r + np.float32(5.0000001201e-1)
    power = np.int32((np.int32(n) + np.int32(127)) << np.int32(23))
    return (p * r * r + r + np.float32(1.0)) * power.view(np.float32)


@numba.njit(inline="always", error_model="numpy")  # type: ignore[untyped-decorator]
def _log(x: Any) -> Any:
    """Natural logarithm of a positive normal number to 2 ulp; coefficients from Cephes."""
    bits = np.float32(x).view(np.int32)
    n = (bits - np.int32(0x3F3504F3)) >> np.int32(23)
    f = np.int32(bits - (n << np.int32(23))).view(np.float32) - np.float32(1.0)
    p = np.float32(7.0376836292e-2)
    p = p * f + np.float32(-1.1514610310e-1)
    p = p * f + np.float32(1.1676998740e-1)
    p = p * f + np.float32(-1.2420140846e-1)
    p = p * f + np.float32(1.4249322787e-1)
    p = p * f + np.float32(-1.6668057665e-1)
    p = p * f + np.float32(2.0000714765e-1)
    p = p * f + np.float32(-2.4999993993e-1)
    p = p * f + np.float32(3.3333331174e-1)
    z = f * f
    tail = f - np.float32(0.5) * z + z * f * p
    return np.float32(n) * np.float32(0.6931471805599453) + tail


@_compile_fast  # type: ignore[untyped-decorator]
def _loss(x: Any, target: Any, weight: Any, gradient: Any, scale: Any) -> Any:
    """Sum of |log(1 + (e^x - 1) weight) - target|, and its gradient times `scale`.

    With a weight above 1, 1 + u can be negative: there the logarithm goes on below u = 0 as it does
    above, as -log(1 - u).
    """
    prefer_wide_vectors()
    total = np.float32(0.0)
    one = np.float32(1.0)
    for s in range(x.size):
        e = _exp(x[s])
        weighted = (e - one) * weight[s]
        sign = -one if weight[s] > one and weighted < np.float32(0.0) else one
        size = one + sign * weighted
        residual = sign * _log(size) - target[s]
        total += abs(residual)
        gradient[s] = (scale if residual > 0 else -scale) * weight[s] * e / size
    return total


@_compile_fast  # type: ignore[untyped-decorator]
def _sum(x: Any) -> Any:
    prefer_wide_vectors()
    total = np.float32(0.0)
    for i in range(x.size):
        total += x[i]
    return total


@_compile_fast  # type: ignore[untyped-decorator]
def _adam(weights: Any, gradient: Any, mean: Any, square: Any, rate: Any, unbias: Any) -> None:
    """One Adam step (Kingma and Ba 2015) with betas .9 and .999.

    Moments are cut to zero before they become subnormal numbers, which are slow.
    """
    for i in range(weights.size):
        g = gradient[i]
        m = np.float32(0.9) * mean[i] + np.float32(0.1) * g
        v = np.float32(0.999) * square[i] + np.float32(0.001) * g * g
        m = m if abs(m) > np.float32(1e-30) else np.float32(0.0)
        v = v if v > np.float32(1e-36) else np.float32(0.0)
        mean[i] = m
        square[i] = v
        weights[i] -= rate * m / (math.sqrt(v * unbias) + np.float32(1e-8))


@_compile  # type: ignore[untyped-decorator]
def _gather(blocks: Any, order: Any, inputs: Any, stride: Any, x: Any, targets: Any) -> None:
    """Lay the chosen blocks side by side, feature by feature."""
    block_size = (inputs + _TARGETS) * BLOCK
    for k in range(order.size):
        start = order[k] * block_size
        for f in range(inputs):
            copy_block(blocks, start + f * BLOCK, x, f * stride + k * BLOCK)
        for f in range(_TARGETS):
            copy_block(blocks, start + (inputs + f) * BLOCK, targets, f * stride + k * BLOCK)


@_compile  # type: ignore[untyped-decorator]
def _prefetch(blocks: Any, order: Any, inputs: Any) -> None:
    """Fetch the chosen blocks while there is other work: they lie all over the memory."""
    rows = inputs + _TARGETS
    for k in range(order.size):
        for f in range(rows):
            prefetch_block(blocks, (order[k] * rows + f) * BLOCK)


@_compile  # type: ignore[untyped-decorator]
def _forward(count: Any, widths: Any, starts: Any, weights: Any, stride: Any, x: Any) -> None:
    layers = widths.size - 1
    for panel in range(0, count, PANEL):
        for layer in range(layers):
            rows, columns, start = widths[layer], widths[layer + 1], starts[layer]
            bias = start + rows * columns
            for t in range(0, columns, DENSE_ROWS):
                y = t * stride + panel
                if layer < layers - 1:
                    dense_relu(
                        x[layer], panel, stride, rows, weights, start + t, columns, 1,
                        weights, bias + t, x[layer + 1], y,
                    )  # fmt: skip
                else:
                    dense_linear(
                        x[layer], panel, stride, rows, weights, start + t, columns, 1,
                        weights, bias + t, x[layer + 1], y,
                    )  # fmt: skip


@_compile  # type: ignore[untyped-decorator]
def _losses(count: Any, stride: Any, x: Any, targets: Any, g: Any, scale: Any) -> Any:
    total = 0.0
    cosine = targets[_OUTPUTS * stride : _OUTPUTS * stride + count]
    for channel in range(_OUTPUTS):
        part = slice(channel * stride, channel * stride + count)
        total += _loss(x[part], targets[part], cosine, g[part], scale)
    return total


@_compile  # type: ignore[untyped-decorator]
def _backward(
    count: Any, widths: Any, starts: Any, weights: Any, stride: Any, x: Any, g: Any,
    tile: Any, gradient: Any,
) -> None:  # fmt: skip
    """Gradient of the weights from the gradient of the outputs in g[-1]."""
    layers = widths.size - 1
    for panel in range(0, count, PANEL):
        for layer in range(layers - 1, 0, -1):
            rows, columns, start = widths[layer], widths[layer + 1], starts[layer]
            for t in range(0, rows, DENSE_ROWS):
                y = t * stride + panel
                dense_gate(
                    g[layer + 1], panel, stride, columns, weights, start + t * columns, 1, columns,
                    x[layer], y, g[layer], y,
                )  # fmt: skip
    for layer in range(layers):
        rows, columns, start = widths[layer], widths[layer + 1], starts[layer]
        # The wider factor of a tile goes to the side that it divides with less waste.
        swap = -columns % OUTER_ROWS[1] > -rows % OUTER_ROWS[1]
        a, a_rows, a_step = (g[layer + 1], columns, 1) if swap else (x[layer], rows, columns)
        b, b_rows, b_step = (x[layer], rows, columns) if swap else (g[layer + 1], columns, 1)
        for i in range(0, a_rows, OUTER_ROWS[0]):
            for j in range(0, b_rows, OUTER_ROWS[1]):
                outer(a, i * stride, b, j * stride, stride, count, tile)
                for t in range(min(OUTER_ROWS[0], a_rows - i)):
                    for u in range(min(OUTER_ROWS[1], b_rows - j)):
                        at = start + (i + t) * a_step + (j + u) * b_step
                        gradient[at] = tile[t * OUTER_ROWS[1] + u]
        for j in range(columns):
            part = slice(j * stride, j * stride + count)
            gradient[start + rows * columns + j] = _sum(g[layer + 1][part])


@_compile  # type: ignore[untyped-decorator]
def _gradient(
    blocks: Any, order: Any, widths: Any, starts: Any, weights: Any, stride: Any, x: Any, g: Any,
    targets: Any, tile: Any, gradient: Any,
) -> Any:  # fmt: skip
    """Summed loss of a mini-batch, and the gradient of its mean."""
    count = order.size * BLOCK
    _gather(blocks, order, widths[0], stride, x[0], targets)
    _forward(count, widths, starts, weights, stride, x)
    scale = np.float32(1.0 / (_OUTPUTS * count))
    total = _losses(count, stride, x[widths.size - 1], targets, g[widths.size - 1], scale)
    _backward(count, widths, starts, weights, stride, x, g, tile, gradient)
    return total


@_compile  # type: ignore[untyped-decorator]
def _epoch(
    blocks: Any, order: Any, batch: Any, rates: Any, step: Any, widths: Any, starts: Any,
    weights: Any, mean: Any, square: Any, stride: Any, x: Any, g: Any, targets: Any, tile: Any,
    gradient: Any,
) -> Any:  # fmt: skip
    total = 0.0
    for k in range(rates.size):
        part = order[k * batch : (k + 1) * batch]
        _prefetch(blocks, order[(k + 1) * batch : (k + 2) * batch], widths[0])
        total += _gradient(
            blocks, part, widths, starts, weights, stride, x, g, targets, tile, gradient
        )
        step += 1
        unbias_square = np.float32(1.0 / (1.0 - 0.999**step))
        rate = np.float32(rates[k] / (1.0 - 0.9**step))
        _adam(weights, gradient, mean, square, rate, unbias_square)
    return total / (order.size * BLOCK * _OUTPUTS)


@_compile  # type: ignore[untyped-decorator]
def _mean_loss(
    blocks: Any, order: Any, batch: Any, widths: Any, starts: Any, weights: Any, stride: Any,
    x: Any, g: Any, targets: Any,
) -> Any:  # fmt: skip
    total = 0.0
    last = widths.size - 1
    for k in range(0, order.size, batch):
        part = order[k : k + batch]
        _gather(blocks, part, widths[0], stride, x[0], targets)
        _forward(part.size * BLOCK, widths, starts, weights, stride, x)
        total += _losses(part.size * BLOCK, stride, x[last], targets, g[last], np.float32(0.0))
    return total / (order.size * BLOCK * _OUTPUTS)


def _round_up(n: int, multiple: int) -> int:
    return -(-n // multiple) * multiple


class KernelTrainer:
    """Weights and optimiser state of one network on the CPU kernel.

    Parameters
    ----------
    layers
        Initial layers, of any widths; copied.
    batch
        Samples a step, a multiple of 16.
    """

    def __init__(self, layers: Sequence[Layer], batch: int) -> None:
        if batch < BLOCK or batch % BLOCK:
            raise ValueError(f"batch must be a positive multiple of {BLOCK}, got {batch}")
        self._batch = batch // BLOCK
        self._shapes = [layer.weights.shape for layer in layers]
        # Widths are padded to whole tiles by weights that are, and stay, zero.
        sizes = [self._shapes[0][0], *(shape[1] for shape in self._shapes)]
        widths = [sizes[0], *(_round_up(n, DENSE_ROWS) for n in sizes[1:])]
        counts = [(rows + 1) * columns for rows, columns in itertools.pairwise(widths)]
        self._widths = np.array(widths)
        self._starts = np.array([0, *itertools.accumulate(counts[:-1])])
        total = sum(counts)
        self._weights, self._mean, self._square, self._gradient = (aligned(total) for _ in range(4))
        for (weights, biases), layer in zip(self._views(self._weights), layers, strict=True):
            weights[:], biases[:] = layer.weights, layer.biases
        # The extra block keeps rows from falling on the same cache sets.
        self._stride = _round_up(batch, PANEL) + BLOCK
        rows = _round_up(max(widths), math.lcm(*OUTER_ROWS))
        shape = (len(widths), rows * self._stride)
        self._x = aligned(math.prod(shape)).reshape(shape)
        self._g = aligned(math.prod(shape)).reshape(shape)
        self._targets = aligned(_TARGETS * self._stride)
        self._tile = aligned(OUTER_SIZE)
        self._step = 0

    def _views(self, flat: Vector) -> list[tuple[Vector, Vector]]:
        """Unpadded weights and biases of every layer inside a padded flat vector."""
        views = []
        for index, (rows, columns) in enumerate(self._shapes):
            padded_rows, padded_columns = self._widths[index], self._widths[index + 1]
            start = self._starts[index]
            middle = start + padded_rows * padded_columns
            matrix = flat[start:middle].reshape(padded_rows, padded_columns)
            views.append((matrix[:rows, :columns], flat[middle : middle + columns]))
        return views

    def layers(self) -> list[Layer]:
        """Copies of the current layers."""
        return [Layer(w.copy(), b.copy()) for w, b in self._views(self._weights)]

    def gradient(self, samples: Samples, order: npt.NDArray[np.int64]) -> tuple[float, list[Layer]]:
        """Mean loss over the blocks in `order` (at most one batch) and its gradient, as layers."""
        if len(order) > self._batch:
            raise ValueError(f"{len(order)} blocks are more than one batch of {self._batch}")
        total = _gradient(
            samples.blocks, order, self._widths, self._starts, self._weights, self._stride,
            self._x, self._g, self._targets, self._tile, self._gradient,
        )  # fmt: skip
        layers = [Layer(w.copy(), b.copy()) for w, b in self._views(self._gradient)]
        return total / (len(order) * BLOCK * _OUTPUTS), layers

    def epoch(self, samples: Samples, order: npt.NDArray[np.int64], rates: Vector) -> float:
        """One step per learning rate over the blocks in `order`; returns the mean training loss."""
        loss = _epoch(
            samples.blocks, order, self._batch, rates, self._step, self._widths, self._starts,
            self._weights, self._mean, self._square, self._stride, self._x, self._g,
            self._targets, self._tile, self._gradient,
        )  # fmt: skip
        self._step += len(rates)
        return float(loss)

    def loss(self, samples: Samples) -> float:
        """Mean loss over all samples."""
        order = np.arange(samples.block_count)
        loss = _mean_loss(
            samples.blocks, order, self._batch, self._widths, self._starts, self._weights,
            self._stride, self._x, self._g, self._targets,
        )  # fmt: skip
        return float(loss)
