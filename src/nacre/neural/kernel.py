"""The CPU fit kernel: weights and optimizer state of a network, trained by compiled code.

A mini-batch is gathered block by block into feature-major matrices that stay in the cache, pushed
through the layers in register tiles (:mod:`nacre.neural.simd`), and its gradient goes straight into
Adam (:mod:`nacre.neural.kernel_code`). The kernel releases the interpreter lock, so materials fit
in parallel on threads.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre.array import Weights, aligned_zeros
from nacre.compile.compilation import Compiled, pack
from nacre.neural.samples import BLOCK, Samples
from nacre.neural.tiles import DENSE_ROWS, LANES, OUTER_ROWS, OUTER_SIZE, PANEL
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer

_gradient = Compiled("nacre.neural.kernel_code:batch_gradient")
_epoch = Compiled("nacre.neural.kernel_code:epoch")
_mean_loss = Compiled("nacre.neural.kernel_code:mean_loss")


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
        # Weights and both moments, each on a boundary of 64 bytes.
        size = _round_up(sum(counts), BLOCK)
        self._state, self._gradient = aligned_zeros(3 * size), aligned_zeros(sum(counts))
        whole = range(0, 3 * size, size)
        self._weights, mean, square = (self._state[k : k + sum(counts)] for k in whole)
        form = activation == SQUARED_RELU, bool(offset), sizes[-1]
        self._widths, self._starts = widths, starts
        network = pack(np.array(widths), starts, self._weights, stride, *form)
        for (own, biases), layer in zip(self._views(self._weights), layers, strict=True):
            own[:], biases[:] = layer.weights, layer.biases
        shape = 3, len(widths), _round_up(max(widths), math.lcm(*OUTER_ROWS)) * stride
        factors, places = _weight_tiles(widths, starts, shape, stride)
        bias_count = _round_up(sum(widths[1:]), LANES)
        rows, targets = aligned_zeros(shape), aligned_zeros((sizes[-1] + 1) * stride)
        sums = aligned_zeros(bias_count * LANES)
        parts = aligned_zeros(len(factors) * OUTER_SIZE + bias_count)
        tiles = factors, sums, parts, places, self._gradient
        self._training = pack(network, rows, rows.reshape(-1), targets, *tiles)
        self._judging = pack(network, rows, targets)
        self._moments = pack(mean, square)
        self.steps = 0
        """Adam steps taken, which it corrects its moments by."""

    def _views(self, flat: Weights) -> list[tuple[Weights, Weights]]:
        """Unpadded weights and biases of every layer inside a padded flat vector."""
        views = []
        for index, (rows, columns) in enumerate(self._shapes):
            padded = self._widths[index], self._widths[index + 1]
            start = self._starts[index]
            middle = start + math.prod(padded)
            matrix = flat[start:middle].reshape(padded)
            views.append((matrix[:rows, :columns], flat[middle : middle + columns]))
        return views

    def copy(self) -> KernelTrainer:
        """A trainer in the same state, with memory of its own."""
        made = KernelTrainer(self.layers(), self._batch * BLOCK, self._activation, self._offset)
        made.follow(self, self.steps)
        return made

    def follow(self, other: KernelTrainer, steps: int) -> None:
        """Take on weights and moments of another trainer of the same network, as after `steps`."""
        self._state[:] = other._state
        self.steps = steps

    def average(self, other: KernelTrainer) -> None:
        """Take on the mean of weights and moments with another trainer of the same network."""
        self._state += other._state
        self._state *= np.float32(0.5)

    def layers(self) -> list[Layer]:
        """Copies of the current layers."""
        return [Layer(w.copy(), b.copy()) for w, b in self._views(self._weights)]

    def gradient(self, samples: Samples, order: npt.NDArray[np.int64]) -> tuple[float, list[Layer]]:
        """Mean loss over the blocks in `order` (at most one batch) and its gradient, as layers."""
        if len(order) > self._batch:
            raise ValueError(f"{len(order)} blocks are more than one batch of {self._batch}")
        _gradient(samples.blocks, order, order[:0], self._training)
        layers = [Layer(w.copy(), b.copy()) for w, b in self._views(self._gradient)]
        return self._mean_loss(samples, order), layers

    def epoch(self, samples: Samples, order: npt.NDArray[np.int64], rates: Weights) -> None:
        """Take one step per learning rate over the blocks in `order`."""
        steps = order, self._batch, rates, self.steps, self._moments
        _epoch(samples.blocks, *steps, self._training)
        self.steps += len(rates)

    def loss(self, samples: Samples) -> float:
        return self._mean_loss(samples, np.arange(samples.block_count))

    def _mean_loss(self, samples: Samples, order: npt.NDArray[np.int64]) -> float:
        loss = np.empty(1)
        _mean_loss(samples.blocks, order, self._batch, self._judging, loss)
        return float(loss[0])
