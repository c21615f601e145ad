"""The code of the CPU fit kernel: forward, backward and Adam over an epoch in one compiled loop.

A mini-batch is gathered block by block into feature-major matrices that stay in the cache, pushed
through the layers in register tiles (:mod:`nacre.neural.simd`), and its gradient goes straight into
Adam. The kernel releases the interpreter lock, so materials fit in parallel on threads.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from nacre.compile.numba_code import compiled, inner, inner_fast
from nacre.neural.samples import BLOCK, MIN_SLOPE
from nacre.neural.simd import (
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
from nacre.neural.tiles import DENSE_ROWS, LANES, OUTER_SIZE, PANEL


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
def _gather(
    blocks: Any, order: Any, inputs: Any, outputs: Any, stride: Any, x: Any, targets: Any
) -> None:
    """Lay the chosen blocks side by side, feature by feature.

    A block has a row for each input, for the target of each output, and for the weight.
    """
    block_size = (inputs + outputs + 1) * BLOCK
    for k in range(order.size):
        start = order[k] * block_size
        for f in range(inputs):
            copy_block(blocks, start + f * BLOCK, x, f * stride + k * BLOCK)
        for f in range(outputs + 1):
            copy_block(blocks, start + (inputs + f) * BLOCK, targets, f * stride + k * BLOCK)


@inner  # type: ignore[untyped-decorator]
def _prefetch(blocks: Any, order: Any, rows: Any) -> None:
    """Fetch the chosen blocks while there is other work: they lie all over the memory."""
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
    panel: Any, count: Any, stride: Any, offset: Any, outputs: Any, x: Any, targets: Any, g: Any,
    scale: Any, sums: Any,
) -> None:  # fmt: skip
    """Gradient of the outputs of a panel; its sums go to the first lanes of rows of `sums`.

    Samples of the panel after the last of `count` become zeros: what follows adds up whole panels.
    """
    end = min(count, panel + PANEL)
    weight = targets[outputs * stride + panel : outputs * stride + end]
    for channel in range(outputs):
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
def batch_gradient(
    blocks: Any, order: Any, upcoming: Any, widths: Any, starts: Any, weights: Any, stride: Any,
    squared: Any, offset: Any, outputs: Any, rows: Any, flat: Any, targets: Any, factors: Any,
    sums: Any, parts: Any, places: Any, gradient: Any,
) -> None:  # fmt: skip
    """Gradient of the mean loss of a mini-batch, while the upcoming one is fetched.

    `flat` are the rows as one, in which a tile of `factors` has its places.
    """
    count = order.size * BLOCK
    # Unpacked at once, Numba would not know that they are contiguous.
    x, g, roots = rows[0], rows[1], rows[2]
    kept = roots if squared else x
    _gather(blocks, order, widths[0], outputs, stride, x[0], targets)
    scale = np.float32(1.0 / (outputs * count))
    last = widths.size - 1
    sums[:] = np.float32(0.0)
    half, size = PANEL // BLOCK // 2, widths[0] + outputs + 1
    for panel in range(0, count, PANEL):
        first = panel // BLOCK
        _prefetch(blocks, upcoming[first : first + half], size)
        _forward(panel, widths, starts, weights, stride, x, roots, squared)
        _prefetch(blocks, upcoming[first + half : first + 2 * half], size)
        _output_gradient(
            panel, count, stride, offset, outputs, x[last], targets, g[last], scale, sums
        )
        _backward(panel, widths, starts, weights, stride, kept, squared, g, sums)
    _weight_gradient(count, stride, flat, factors, sums, parts, places, gradient)


@compiled
def epoch(
    blocks: Any, order: Any, batch: Any, rates: Any, step: Any, mean: Any, square: Any,
    widths: Any, starts: Any, weights: Any, stride: Any, squared: Any, offset: Any, outputs: Any,
    rows: Any, flat: Any, targets: Any, factors: Any, sums: Any, parts: Any, places: Any,
    gradient: Any,
) -> None:  # fmt: skip
    """An Adam step for each rate; `step` have been taken before."""
    for k in range(rates.size):
        part = order[k * batch : (k + 1) * batch]
        upcoming = order[(k + 1) * batch : (k + 2) * batch]
        batch_gradient(
            blocks, part, upcoming, widths, starts, weights, stride, squared, offset, outputs, rows,
            flat, targets, factors, sums, parts, places, gradient,
        )  # fmt: skip
        step += 1
        unbias_square = np.float32(1.0 / (1.0 - 0.999**step))
        rate = np.float32(rates[k] / (1.0 - 0.9**step))
        _adam(weights, gradient, mean, square, rate, unbias_square)


@compiled
def mean_loss(
    blocks: Any, order: Any, batch: Any, widths: Any, starts: Any, weights: Any, stride: Any,
    squared: Any, offset: Any, outputs: Any, rows: Any, targets: Any, loss: Any,
) -> None:  # fmt: skip
    """Write the mean loss over the blocks in an order to the first of `loss`."""
    total = 0.0
    x, roots = rows[0], rows[2]
    last = x[widths.size - 1]
    for k in range(0, order.size, batch):
        part = order[k : k + batch]
        count = part.size * BLOCK
        _gather(blocks, part, widths[0], outputs, stride, x[0], targets)
        for panel in range(0, count, PANEL):
            _forward(panel, widths, starts, weights, stride, x, roots, squared)
        weight = targets[outputs * stride : outputs * stride + count]
        for channel in range(outputs):
            values = slice(channel * stride, channel * stride + count)
            total += _loss(last[values], targets[values], weight, offset)
    loss[0] = total / (order.size * BLOCK * outputs)
