"""The compiled loop of a network at many hits, which lie in the lanes of vectors."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from nacre.compile.emitter import ZERO, Emitter, generated
from nacre.compile.numba_code import compiled
from nacre.compile.vector_code import LANES
from nacre.mitsuba.textures.network_tiles import HITS, ROWS, VECTORS

_i64 = ir.IntType(64)


def _layer(rectified: bool) -> Any:
    """An intrinsic: y[r] = b[r] + sum over inputs i of w[i, r] x[i], for `ROWS` outputs r.

    Rows of x and y, each of `HITS` numbers, lie behind each other, and so do biases and weights,
    which come input by input.
    """

    @intrinsic  # type: ignore[untyped-decorator]
    def tile(
        _context: Any, w: Any, w_at: Any, inputs: Any, x: Any, x_at: Any, y: Any, y_at: Any
    ) -> Any:
        i = types.intp
        signature = types.void(w, i, i, x, i, y, i)

        def emit_tile(emit: Emitter, arguments: Any) -> None:
            _, w_at, inputs, _, x_at, _, y_at = arguments
            builder = emit.builder
            sums = emit.accumulators(ROWS, VECTORS)
            for r, totals in enumerate(sums):
                bias = emit.splat(0, emit.at(w_at, (_i64(r), 1)))
                for total in totals:
                    builder.store(bias, total)
            weights_at = emit.at(w_at, (_i64(1), ROWS))
            with cgutils.for_range(builder, inputs) as loop:
                row = emit.at(x_at, (loop.index, HITS))
                seen = [emit.load(3, emit.at(row, (_i64(v), LANES))) for v in range(VECTORS)]
                column = emit.at(weights_at, (loop.index, ROWS))
                for r, totals in enumerate(sums):
                    weight = emit.splat(0, emit.at(column, (_i64(r), 1)))
                    for value, total in zip(seen, totals, strict=True):
                        emit.multiply_add(weight, value, total)
            for r, totals in enumerate(sums):
                for v, total in enumerate(totals):
                    value = builder.load(total)
                    if rectified:
                        positive = builder.fcmp_ordered(">", value, ZERO)
                        value = builder.select(positive, value, ZERO)
                    emit.store(value, 5, emit.at(y_at, (_i64(r), HITS), (_i64(v), LANES)))

        return signature, generated(emit_tile)

    return tile


_hidden, _last = _layer(True), _layer(False)


@compiled
def network(
    chosen: Any, corners: Any, parts: Any, codes: Any, directions: Any, sizes: Any, weights: Any,
    state: Any, other: Any, found: Any,
) -> None:  # fmt: skip
    """Outputs of a network, (outputs, n), for those hits of n that are `chosen`.

    It sees the sum of `codes` (texels, values) at `corners` (k, n) times `parts` (k, n), then
    `directions` (d, n). `sizes` are numbers of inputs and of the outputs of each layer; `state` and
    `other` hold what two layers give.
    """
    values, seen, layers = codes.shape[1], directions.shape[0], sizes.size - 1
    for first in range(0, chosen.size, HITS):
        count = min(HITS, chosen.size - first)
        for lane in range(HITS):
            hit = chosen[first + min(lane, count - 1)]
            for k in range(values):
                state[k * HITS + lane] = 0.0
            for corner in range(corners.shape[0]):
                code, part = codes[corners[corner, hit]], parts[corner, hit]
                for k in range(values):
                    state[k * HITS + lane] += code[k] * part
            for k in range(seen):
                state[(values + k) * HITS + lane] = directions[k, hit]
        at = 0
        for layer in range(layers):
            inputs = sizes[layer]
            for row in range(0, sizes[layer + 1], ROWS):
                if layer == layers - 1:
                    _last(weights, at, inputs, state, 0, other, row * HITS)
                else:
                    _hidden(weights, at, inputs, state, 0, other, row * HITS)
                at += (inputs + 1) * ROWS
            state, other = other, state
        for k in range(found.shape[0]):
            for lane in range(count):
                found[k, chosen[first + lane]] = state[k * HITS + lane]
