"""The CPU fit kernel: forward, backward and Adam over an epoch in one compiled loop.

A mini-batch is gathered block by block into feature-major matrices that stay in the cache, pushed
through the layers in register tiles (:mod:`nacre.neural.simd`), and its gradient goes straight into
Adam. The kernel releases the interpreter lock, so materials fit in parallel on threads.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from nacre.array import Weights, aligned_zeros
from nacre.compile.compilation import compiled, inner, inner_fast
from nacre.neural.samples import BLOCK, MIN_SLOPE, Samples
from nacre.neural.simd import (
    DENSE_ROWS,
    LANES,
    OUTER_ROWS,
    OUTER_SIZE,
    PANEL,
    copy_block,
    dense_gate,
    dense_linear,
    dense_relu,
    dense_slope,
    dense_squared_relu,
    outer,
    prefetch_block,
    sum_lanes,
)
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer

_OUTPUTS = 3
_TARGETS = _OUTPUTS + 1  # rows after the inputs in a block of samples: three targets and the cosine


@numba.njit(inline="always", error_model="numpy")  # type: ignore[untyped-decorator]
def _exp(x: Any) -> Any:
    """e^x to 2 ulp, coefficients from Cephes; vectorizes, unlike the library's."""
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


@inner_fast  # type: ignore[untyped-decorator]
def _loss(x: Any, target: Any, weight: Any, offset: Any) -> Any:
    """Sum of |log(1 + (e^x - offset) weight) - log(1 + target)|; the offset is 1 or 0.

    With a weight above 1, 1 + u can be negative: there the logarithm goes on below u = 0 as it does
    above, as -log(1 - u).
    """
    total = np.float32(0.0)
    one = np.float32(1.0)
    for s in range(x.size):
        e = _exp(x[s])
        u = (e - one) * weight[s] if offset else e * weight[s]
        below = weight[s] > one and u < np.float32(0.0)
        aim = one + target[s]
        total += abs(_log(one / ((one - u) * aim) if below else (one + u) / aim))
    return total


@inner_fast  # type: ignore[untyped-decorator]
def _loss_gradient(x: Any, target: Any, weight: Any, offset: Any, gradient: Any, scale: Any) -> Any:
    """Gradient of :func:`_loss` times `scale`, which needs no logarithm; returns its sum."""
    total = np.float32(0.0)
    one = np.float32(1.0)
    for s in range(x.size):
        e = _exp(x[s])
        u = (e - one) * weight[s] if offset else e * weight[s]
        size = one + (abs(u) if weight[s] > one else u)
        g = (scale if u > target[s] else -scale) * weight[s] * e / size
        if not offset and u < target[s]:
            g = -scale * weight[s] * max(e, np.float32(MIN_SLOPE)) / size
        gradient[s] = g
        total += g
    return total


@inner_fast  # type: ignore[untyped-decorator]
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


@inner  # type: ignore[untyped-decorator]
def _gather(blocks: Any, order: Any, inputs: Any, stride: Any, x: Any, targets: Any) -> None:
    """Lay the chosen blocks side by side, feature by feature."""
    block_size = (inputs + _TARGETS) * BLOCK
    for k in range(order.size):
        start = order[k] * block_size
        for f in range(inputs):
            copy_block(blocks, start + f * BLOCK, x, f * stride + k * BLOCK)
        for f in range(_TARGETS):
            copy_block(blocks, start + (inputs + f) * BLOCK, targets, f * stride + k * BLOCK)


@inner  # type: ignore[untyped-decorator]
def _prefetch(blocks: Any, order: Any, inputs: Any) -> None:
    """Fetch the chosen blocks while there is other work: they lie all over the memory."""
    rows = inputs + _TARGETS
    for k in range(order.size):
        for f in range(rows):
            prefetch_block(blocks, (order[k] * rows + f) * BLOCK)


@inner  # type: ignore[untyped-decorator]
def _forward(
    panel: Any, widths: Any, starts: Any, weights: Any, stride: Any, x: Any, roots: Any,
    squared: Any,
) -> None:  # fmt: skip
    """Activations of a panel of samples, and their roots where they are squares."""
    layers = widths.size - 1
    for layer in range(layers):
        rows, columns, start = widths[layer], widths[layer + 1], starts[layer]
        bias = start + rows * columns
        for t in range(0, columns, DENSE_ROWS):
            y = t * stride + panel
            if layer < layers - 1 and squared:
                dense_squared_relu(
                    x[layer], panel, stride, rows, weights, start + t, columns, 1, bias + t,
                    x[layer + 1], roots[layer + 1], y,
                )  # fmt: skip
            elif layer < layers - 1:
                dense_relu(
                    x[layer], panel, stride, rows, weights, start + t, columns, 1, bias + t,
                    x[layer + 1], y,
                )  # fmt: skip
            else:
                dense_linear(
                    x[layer], panel, stride, rows, weights, start + t, columns, 1, bias + t,
                    x[layer + 1], y,
                )  # fmt: skip


@inner  # type: ignore[untyped-decorator]
def _output_gradient(
    panel: Any, count: Any, stride: Any, offset: Any, x: Any, targets: Any, g: Any, scale: Any,
    sums: Any,
) -> None:  # fmt: skip
    """Gradient of the outputs of a panel; its sums go to the first lanes of rows of `sums`.

    Samples of the panel after the last of `count` become zeros: what follows adds up whole panels.
    """
    end = min(count, panel + PANEL)
    weight = targets[_OUTPUTS * stride + panel : _OUTPUTS * stride + end]
    for channel in range(_OUTPUTS):
        row = channel * stride
        part = slice(row + panel, row + end)
        sums[channel * LANES] += _loss_gradient(
            x[part], targets[part], weight, offset, g[part], scale
        )
        g[row + end : row + panel + PANEL] = np.float32(0.0)


@inner  # type: ignore[untyped-decorator]
def _backward(
    panel: Any, widths: Any, starts: Any, weights: Any, stride: Any, kept: Any, squared: Any,
    g: Any, sums: Any,
) -> None:  # fmt: skip
    """Gradients of all sums of a panel from those of the outputs in g[-1].

    `kept` are the activations, or their roots where they are squares. Rows of `sums` belong to the
    layers from the last to the first.
    """
    at = widths[-1] * LANES
    for layer in range(widths.size - 2, 0, -1):
        rows, columns, start = widths[layer], widths[layer + 1], starts[layer]
        for t in range(0, rows, DENSE_ROWS):
            if squared:
                dense_slope(
                    g[layer + 1], panel, stride, columns, weights, start + t * columns, 1, columns,
                    kept[layer], g[layer], t * stride + panel, sums, at + t * LANES,
                )  # fmt: skip
            else:
                dense_gate(
                    g[layer + 1], panel, stride, columns, weights, start + t * columns, 1, columns,
                    kept[layer], g[layer], t * stride + panel, sums, at + t * LANES,
                )  # fmt: skip
        at += rows * LANES


@inner  # type: ignore[untyped-decorator]
def _weight_gradient(
    count: Any, stride: Any, rows: Any, factors: Any, sums: Any, parts: Any, places: Any,
    gradient: Any,
) -> None:  # fmt: skip
    """Gradient of weights and biases from the rows of all activations and of their gradients."""
    for k in range(factors.shape[0]):
        outer(rows, factors[k, 0], factors[k, 1], stride, count, parts, k * OUTER_SIZE)
    biases = factors.shape[0] * OUTER_SIZE
    for first in range(0, sums.size, LANES * LANES):
        sum_lanes(sums, first, parts, biases + first // LANES)
    for i in range(gradient.size):
        gradient[i] = parts[places[i]]


@compiled
def _gradient(
    blocks: Any, order: Any, upcoming: Any, widths: Any, starts: Any, weights: Any, stride: Any,
    squared: Any, offset: Any, rows: Any, targets: Any, factors: Any, sums: Any, parts: Any,
    places: Any, gradient: Any,
) -> None:  # fmt: skip
    """Gradient of the mean loss of a mini-batch, while the upcoming one is fetched."""
    count = order.size * BLOCK
    # Unpacked at once, Numba would not know that they are contiguous.
    x, g, roots = rows[0], rows[1], rows[2]
    kept = roots if squared else x
    _gather(blocks, order, widths[0], stride, x[0], targets)
    scale = np.float32(1.0 / (_OUTPUTS * count))
    last = widths.size - 1
    sums[:] = np.float32(0.0)
    half = PANEL // BLOCK // 2
    for panel in range(0, count, PANEL):
        first = panel // BLOCK
        _prefetch(blocks, upcoming[first : first + half], widths[0])
        _forward(panel, widths, starts, weights, stride, x, roots, squared)
        _prefetch(blocks, upcoming[first + half : first + 2 * half], widths[0])
        _output_gradient(panel, count, stride, offset, x[last], targets, g[last], scale, sums)
        _backward(panel, widths, starts, weights, stride, kept, squared, g, sums)
    _weight_gradient(count, stride, rows.reshape(-1), factors, sums, parts, places, gradient)


@compiled
def _epoch(
    blocks: Any, order: Any, batch: Any, rates: Any, step: Any, mean: Any, square: Any,
    widths: Any, starts: Any, weights: Any, stride: Any, squared: Any, offset: Any, rows: Any,
    targets: Any, factors: Any, sums: Any, parts: Any, places: Any, gradient: Any,
) -> None:  # fmt: skip
    for k in range(rates.size):
        part = order[k * batch : (k + 1) * batch]
        upcoming = order[(k + 1) * batch : (k + 2) * batch]
        _gradient(
            blocks, part, upcoming, widths, starts, weights, stride, squared, offset, rows, targets,
            factors, sums, parts, places, gradient,
        )  # fmt: skip
        step += 1
        unbias_square = np.float32(1.0 / (1.0 - 0.999**step))
        rate = np.float32(rates[k] / (1.0 - 0.9**step))
        _adam(weights, gradient, mean, square, rate, unbias_square)


@compiled
def _mean_loss(
    blocks: Any, order: Any, batch: Any, widths: Any, starts: Any, weights: Any, stride: Any,
    squared: Any, offset: Any, rows: Any, targets: Any,
) -> Any:  # fmt: skip
    total = 0.0
    x, roots = rows[0], rows[2]
    last = x[widths.size - 1]
    for k in range(0, order.size, batch):
        part = order[k : k + batch]
        count = part.size * BLOCK
        _gather(blocks, part, widths[0], stride, x[0], targets)
        for panel in range(0, count, PANEL):
            _forward(panel, widths, starts, weights, stride, x, roots, squared)
        weight = targets[_OUTPUTS * stride : _OUTPUTS * stride + count]
        for channel in range(_OUTPUTS):
            values = slice(channel * stride, channel * stride + count)
            total += _loss(last[values], targets[values], weight, offset)
    return total / (order.size * BLOCK * _OUTPUTS)


def _weight_tiles(
    widths: Sequence[int], starts: npt.NDArray[np.int64], shape: Sequence[int], stride: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """How the gradient of the weights is put together from tiles of outer products.

    Returns the offsets of the two factors of every tile in an array of activations and their
    gradients of a shape, and for every weight and bias its place in what the tiles write, one after
    the other, followed by the sums of gradients over samples, from the last layer to the first.
    """
    factors: list[tuple[int, int]] = []
    places = np.zeros(starts[-1] + (widths[-2] + 1) * widths[-1], np.int64)
    inside = np.arange(math.prod(OUTER_ROWS)).reshape(OUTER_ROWS)
    for layer, (rows, columns) in enumerate(itertools.pairwise(widths)):
        matrix = places[starts[layer] : starts[layer] + rows * columns].reshape(rows, columns)
        a, b = layer * shape[2], (shape[1] + layer + 1) * shape[2]
        # The wider factor of a tile goes to the side that it divides with less waste.
        if -columns % OUTER_ROWS[1] > -rows % OUTER_ROWS[1]:
            a, b, matrix = b, a, matrix.T
        # The seven rows of b stay in the first-level cache while those of a go by.
        for j in range(0, matrix.shape[1], OUTER_ROWS[1]):
            for i in range(0, matrix.shape[0], OUTER_ROWS[0]):
                part = matrix[i : i + OUTER_ROWS[0], j : j + OUTER_ROWS[1]]
                part[:] = len(factors) * OUTER_SIZE + inside[: part.shape[0], : part.shape[1]]
                factors.append((a + i * stride, b + j * stride))
    bias = len(factors) * OUTER_SIZE
    for layer in range(len(widths) - 2, -1, -1):
        start = starts[layer] + widths[layer] * widths[layer + 1]
        places[start : start + widths[layer + 1]] = bias + np.arange(widths[layer + 1])
        bias += widths[layer + 1]
    return np.array(factors), places


def _round_up(n: int, multiple: int) -> int:
    return -(-n // multiple) * multiple


class KernelTrainer:
    """Weights and optimizer state of one network on the CPU kernel.

    Initial layers, of any widths, are copied; a step takes `batch` samples, a multiple of 16. The
    activation is ReLU or its square. Reflectances are e^x - `offset` for outputs x.
    """

    def __init__(
        self, layers: Sequence[Layer], batch: int, activation: str = RELU, offset: float = 1.0
    ) -> None:
        if batch < BLOCK or batch % BLOCK:
            raise ValueError(f"batch must be a positive multiple of {BLOCK}, got {batch}")
        self._batch, self._activation, self._offset = batch // BLOCK, activation, offset
        self._shapes = [layer.weights.shape for layer in layers]
        # Widths are padded to whole tiles by weights that are, and stay, zero.
        sizes = [self._shapes[0][0], *(shape[1] for shape in self._shapes)]
        widths = [sizes[0], *(_round_up(n, DENSE_ROWS) for n in sizes[1:])]
        counts = [(rows + 1) * columns for rows, columns in itertools.pairwise(widths)]
        starts = np.array([0, *itertools.accumulate(counts[:-1])])
        # The extra block keeps rows from falling on the same cache sets.
        stride = _round_up(batch, PANEL) + BLOCK
        self._weights, self._mean, self._square, self._gradient = (
            aligned_zeros(sum(counts)) for _ in range(4)
        )
        form = activation == SQUARED_RELU, bool(offset)
        self._network = np.array(widths), starts, self._weights, stride, *form
        for (weights, biases), layer in zip(self._views(self._weights), layers, strict=True):
            weights[:], biases[:] = layer.weights, layer.biases
        shape = 3, len(widths), _round_up(max(widths), math.lcm(*OUTER_ROWS)) * stride
        factors, places = _weight_tiles(widths, starts, shape, stride)
        bias_count = _round_up(sum(widths[1:]), LANES)
        rows, targets = aligned_zeros(shape), aligned_zeros(_TARGETS * stride)
        sums = aligned_zeros(bias_count * LANES)
        parts = aligned_zeros(len(factors) * OUTER_SIZE + bias_count)
        self._scratch = rows, targets, factors, sums, parts, places, self._gradient
        self._step = 0

    def _views(self, flat: Weights) -> list[tuple[Weights, Weights]]:
        """Unpadded weights and biases of every layer inside a padded flat vector."""
        views = []
        padded_widths, starts, *_ = self._network
        for index, (rows, columns) in enumerate(self._shapes):
            padded = padded_widths[index], padded_widths[index + 1]
            start, middle = starts[index], starts[index] + math.prod(padded)
            matrix = flat[start:middle].reshape(padded)
            views.append((matrix[:rows, :columns], flat[middle : middle + columns]))
        return views

    def copy(self) -> KernelTrainer:
        """A trainer in the same state, with memory of its own."""
        made = KernelTrainer(self.layers(), self._batch * BLOCK, self._activation, self._offset)
        for own, other in zip(made._state, self._state, strict=True):
            own[:] = other
        made._step = self._step
        return made

    @staticmethod
    def average(trainers: Sequence[KernelTrainer]) -> None:
        """Give trainers of one network the mean of their weights and moments."""
        for arrays in zip(*(trainer._state for trainer in trainers), strict=True):
            arrays[0][:] = np.mean(arrays, axis=0)
            for array in arrays[1:]:
                array[:] = arrays[0]

    @property
    def _state(self) -> tuple[Weights, Weights, Weights]:
        return self._weights, self._mean, self._square

    def layers(self) -> list[Layer]:
        """Copies of the current layers."""
        return [Layer(w.copy(), b.copy()) for w, b in self._views(self._weights)]

    def gradient(self, samples: Samples, order: npt.NDArray[np.int64]) -> tuple[float, list[Layer]]:
        """Mean loss over the blocks in `order` (at most one batch) and its gradient, as layers."""
        if len(order) > self._batch:
            raise ValueError(f"{len(order)} blocks are more than one batch of {self._batch}")
        _gradient(samples.blocks, order, order[:0], *self._network, *self._scratch)
        layers = [Layer(w.copy(), b.copy()) for w, b in self._views(self._gradient)]
        return self._mean_loss(samples, order), layers

    def epoch(self, samples: Samples, order: npt.NDArray[np.int64], rates: Weights) -> None:
        """Take one step per learning rate over the blocks in `order`."""
        steps = order, self._batch, rates, self._step, self._mean, self._square
        _epoch(samples.blocks, *steps, *self._network, *self._scratch)
        self._step += len(rates)

    def loss(self, samples: Samples) -> float:
        return self._mean_loss(samples, np.arange(samples.block_count))

    def _mean_loss(self, samples: Samples, order: npt.NDArray[np.int64]) -> float:
        rows, targets = self._scratch[:2]
        return float(_mean_loss(samples.blocks, order, self._batch, *self._network, rows, targets))
