"""Vector building blocks for the fit kernel, as LLVM IR inside Numba functions.

Numba's loop vectorizer cannot keep a tile of a matrix product in registers, so the three inner
loops that hold nearly all of the arithmetic are emitted here with explicit vector types. LLVM
lowers them to AVX-512, AVX2 or NEON; only the tile sizes depend on the machine.

Matrices of activations are stored feature by feature: row `r`, sample `s` of a matrix lies at
`r * stride + s` of a flat, 64-byte aligned float32 array. Offsets and strides count elements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from nacre.compile.emitter import ZERO, Emitter, generated
from nacre.neural.samples import BLOCK
from nacre.neural.tiles import DENSE_ROWS, LANES, OUTER_ROWS, VECTORS

_f32 = ir.FloatType()
_i64 = ir.IntType(64)


def _where_positive(emit: Emitter, condition: Any, value: Any) -> Any:
    positive = emit.builder.fcmp_ordered(">", condition, ZERO)
    return emit.builder.select(positive, value, ZERO)


def _products(
    emit: Emitter, x_at: Any, row: Any, inputs: Any, w_at: Any, w_row: Any, w_column: Any,
    starts: Sequence[Any],
) -> list[list[Any]]:  # fmt: skip
    """Accumulators of starts[t] + sum_i w[i, t] x[i, s] over a panel of samples.

    Argument 0 of the intrinsic is x, argument 4 is w; w[i, t] lies at `w_at + i * w_row +
    t * w_column`.
    """
    builder = emit.builder
    tile = emit.accumulators(DENSE_ROWS, VECTORS)
    for start, vectors in zip(starts, tile, strict=True):
        for accumulator in vectors:
            builder.store(start, accumulator)
    with cgutils.for_range(builder, inputs) as loop:
        x_row = builder.add(x_at, builder.mul(loop.index, row))
        w_row_at = builder.add(w_at, builder.mul(loop.index, w_row))
        weights = [emit.splat(4, emit.at(w_row_at, (w_column, t))) for t in range(DENSE_ROWS)]
        for v in range(VECTORS):
            value = emit.load(0, emit.at(x_row, (_i64(v), LANES)))
            for weight, vectors in zip(weights, tile, strict=True):
                emit.multiply_add(weight, value, vectors[v])
    return tile


@intrinsic  # type: ignore[untyped-decorator]
def dense_linear(
    _context: Any, x: Any, x_offset: Any, stride: Any, count: Any, w: Any, w_offset: Any,
    w_stride: Any, w_step: Any, b_offset: Any, y: Any, y_offset: Any,
) -> Any:  # fmt: skip
    """Tile of a dense layer: y[t, s] = b[t] + sum_i w[i, t] x[i, s] over a panel of samples."""
    return _before((x, w, y), lambda _, total: (total,))


@intrinsic  # type: ignore[untyped-decorator]
def dense_relu(
    _context: Any, x: Any, x_offset: Any, stride: Any, count: Any, w: Any, w_offset: Any,
    w_stride: Any, w_step: Any, b_offset: Any, y: Any, y_offset: Any,
) -> Any:  # fmt: skip
    """The same before a ReLU: y[t, s] is 0 where the sum is negative."""
    return _before((x, w, y), lambda emit, total: (_where_positive(emit, total, total),))


@intrinsic  # type: ignore[untyped-decorator]
def dense_squared_relu(
    _context: Any, x: Any, x_offset: Any, stride: Any, count: Any, w: Any, w_offset: Any,
    w_stride: Any, w_step: Any, b_offset: Any, y: Any, roots: Any, y_offset: Any,
) -> Any:  # fmt: skip
    """The same before a squared ReLU: of what a ReLU gives, y has the squares, `roots` itself."""

    def values(emit: Emitter, total: Any) -> tuple[Any, Any]:
        root = _where_positive(emit, total, total)
        return emit.builder.fmul(root, root), root

    return _before((x, w, y, roots), values)


def _before(arrays: tuple[Any, ...], values: Callable[[Emitter, Any], tuple[Any, ...]]) -> Any:
    """Signature and code of a tile of the forward pass, from the types of its arrays.

    `values` makes of a vector of sums what goes to each array after the weights, laid out alike.
    """
    i = types.intp
    x, w, *targets = arrays
    signature = types.void(x, i, i, i, w, i, i, i, i, *targets, i)

    def emit_tile(emit: Emitter, arguments: Any) -> None:
        (_, x_at, row, inputs, _, w_at, w_row, w_column, b_at, *_, y_at) = arguments
        biases = [emit.splat(4, emit.at(b_at, (_i64(t), 1))) for t in range(DENSE_ROWS)]
        tile = _products(emit, x_at, row, inputs, w_at, w_row, w_column, biases)
        for t, vectors in enumerate(tile):
            for v, accumulator in enumerate(vectors):
                at = emit.at(y_at, (row, t), (_i64(v), LANES))
                for array, value in enumerate(values(emit, emit.builder.load(accumulator)), 9):
                    emit.store(value, array, at)

    return signature, generated(emit_tile)


@intrinsic  # type: ignore[untyped-decorator]
def dense_gate(
    _context: Any, x: Any, x_offset: Any, stride: Any, count: Any, w: Any, w_offset: Any,
    w_stride: Any, w_step: Any, activations: Any, y: Any, y_offset: Any, sums: Any,
    sums_offset: Any,
) -> Any:  # fmt: skip
    """Tile of a dense layer without biases, behind the derivative of ReLU.

    y[t, s] = sum_i w[i, t] x[i, s] where activations[t, s], laid out as y, are positive; else 0.
    The panel's part of the sum of row t is added to the vector at `sums_offset + t * LANES`.
    """
    return _behind((x, activations, y, sums), _where_positive)


@intrinsic  # type: ignore[untyped-decorator]
def dense_slope(
    _context: Any, x: Any, x_offset: Any, stride: Any, count: Any, w: Any, w_offset: Any,
    w_stride: Any, w_step: Any, roots: Any, y: Any, y_offset: Any, sums: Any, sums_offset: Any,
) -> Any:  # fmt: skip
    """The same behind the derivative of a squared ReLU: the sum times 2 roots[t, s]."""

    def derivative(emit: Emitter, root: Any, value: Any) -> Any:
        return emit.builder.fmul(emit.builder.fadd(root, root), value)

    return _behind((x, roots, y, sums), derivative)


def _behind(
    arrays: tuple[Any, Any, Any, Any], derivative: Callable[[Emitter, Any, Any], Any]
) -> Any:
    """Signature and code of a tile of the backward pass, from the types of its arrays.

    `derivative` takes what the forward pass kept, and the gradient after the activation.
    """
    i = types.intp
    x, kept, y, sums = arrays
    signature = types.void(x, i, i, i, x, i, i, i, kept, y, i, sums, i)

    def emit_tile(emit: Emitter, arguments: Any) -> None:
        (_, x_at, row, inputs, _, w_at, w_row, w_column, _, _, y_at, _, sums_at) = arguments
        zeros = [ZERO] * DENSE_ROWS
        tile = _products(emit, x_at, row, inputs, w_at, w_row, w_column, zeros)
        for t, vectors in enumerate(tile):
            total_at = emit.at(sums_at, (_i64(t), LANES))
            total = emit.load(11, total_at)
            for v, accumulator in enumerate(vectors):
                at = emit.at(y_at, (row, t), (_i64(v), LANES))
                value = derivative(emit, emit.load(8, at), emit.builder.load(accumulator))
                emit.store(value, 9, at)
                total = emit.builder.fadd(total, value)
            emit.store(total, 11, total_at)

    return signature, generated(emit_tile)


@intrinsic  # type: ignore[untyped-decorator]
def outer(
    _context: Any, x: Any, a_offset: Any, b_offset: Any, stride: Any, count: Any, y: Any,
    y_offset: Any,
) -> Any:  # fmt: skip
    """Tile of an outer product summed over samples: y[7 t + u] = sum_s a[t, s] b[u, s].

    a and b are rows of x. `count` samples, a multiple of :data:`BLOCK`; t and u run over
    :data:`OUTER_ROWS`.
    """
    i = types.intp
    signature = types.void(x, i, i, i, i, y, i)

    def emit_tile(emit: Emitter, arguments: Any) -> None:
        (_, a_at, b_at, row, samples, _, y_at) = arguments
        tile = emit.accumulators(*OUTER_ROWS)
        for accumulator in (x for vectors in tile for x in vectors):
            emit.builder.store(ZERO, accumulator)
        with cgutils.for_range(emit.builder, emit.builder.sdiv(samples, _i64(LANES))) as loop:
            step = (loop.index, LANES)
            left = [emit.load(0, emit.at(a_at, step, (row, t))) for t in range(OUTER_ROWS[0])]
            for u in range(OUTER_ROWS[1]):
                right = emit.load(0, emit.at(b_at, step, (row, u)))
                for value, vectors in zip(left, tile, strict=True):
                    emit.multiply_add(value, right, vectors[u])
        sums = emit.sums([emit.builder.load(x) for vectors in tile for x in vectors])
        for index, vector in enumerate(sums):
            emit.store(vector, 5, emit.at(y_at, (_i64(index), LANES)))

    return signature, generated(emit_tile)


@intrinsic  # type: ignore[untyped-decorator]
def sum_lanes(_context: Any, x: Any, x_offset: Any, y: Any, y_offset: Any) -> Any:
    """Sums over the lanes of as many vectors as a vector has lanes: y[t] = sum_l x[t, l]."""
    i = types.intp
    signature = types.void(x, i, y, i)

    def emit_tile(emit: Emitter, arguments: Any) -> None:
        (_, x_at, _, y_at) = arguments
        vectors = [emit.load(0, emit.at(x_at, (_i64(t), LANES))) for t in range(LANES)]
        emit.store(emit.sums(vectors)[0], 2, y_at)

    return signature, generated(emit_tile)


@intrinsic  # type: ignore[untyped-decorator]
def prefetch_block(_context: Any, x: Any, x_offset: Any) -> Any:
    """Prefetch the :data:`BLOCK` values at an offset into the second-level cache."""
    signature = types.void(x, types.intp)

    def emit_tile(emit: Emitter, arguments: Any) -> None:
        emit.prefetch(0, arguments[1])

    return signature, generated(emit_tile)


@intrinsic  # type: ignore[untyped-decorator]
def copy_block(_context: Any, x: Any, x_offset: Any, y: Any, y_offset: Any) -> Any:
    """Copy :data:`BLOCK` values between aligned offsets of two arrays."""
    signature = types.void(x, types.intp, y, types.intp)

    def emit_tile(emit: Emitter, arguments: Any) -> None:
        (_, x_at, _, y_at) = arguments
        emit.store(emit.load(0, x_at, ir.VectorType(_f32, BLOCK)), 2, y_at)

    return signature, generated(emit_tile)
