"""The compiled loop from reflectance to its products with functions of the default codec.

Luma and chroma are made of a few texels at a few pairs of directions at a time, which stay in the
first cache until they are multiplied: what comes from memory is reflectance as it is kept, once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from nacre.compile.emitter import VECTOR, ZERO, Emitter, generated
from nacre.compile.numba_code import compiled
from nacre.compile.vector_code import LANES
from nacre.numerics.channels import CHROMA, LUMA
from nacre.textures.codecs.basis.product_tiles import narrow_tile, wide_tile
from nacre.textures.codecs.basis.tile_sizes import BLOCK, PANEL, ROWS

_i64 = ir.IntType(64)
_HALVES = ir.VectorType(ir.HalfType(), LANES)
_INDICES = ir.VectorType(ir.IntType(32), LANES)
_LINE = 64  # bytes


def _all(value: float) -> ir.Constant:
    return ir.Constant(VECTOR, [value] * LANES)


def _root(emit: Emitter, value: Any) -> Any:
    """Square roots: of numbers below 0 they are 0; of what is not finite they are not, either."""
    below = emit.builder.fcmp_ordered("<", value, ZERO)
    return emit.call("sqrt", emit.builder.select(below, emit.builder.fmul(value, ZERO), value))


def _every_third(emit: Emitter, vectors: Sequence[Any], first: int) -> Any:
    """Lanes first, first + 3, ... of three vectors in a row."""
    wanted = [first + 3 * k for k in range(LANES)]
    near = [w if w < 2 * LANES else 0 for w in wanted]
    both = [k if w < 2 * LANES else w - LANES for k, w in enumerate(wanted)]
    low = emit.builder.shuffle_vector(*vectors[:2], ir.Constant(_INDICES, near))
    return emit.builder.shuffle_vector(low, vectors[2], ir.Constant(_INDICES, both))


@intrinsic  # type: ignore[untyped-decorator]
def _split(
    _context: Any, rgb: Any, at: Any, mean: Any, entry: Any, y: Any, luma_at: Any, chroma_at: Any
) -> Any:
    """Luma less its mean, and chroma behind that of all texels, of a vector of pairs."""
    signature = types.void(rgb, at, mean, entry, y, luma_at, chroma_at)

    def emit_split(emit: Emitter, arguments: Any) -> None:
        _, at, _, entry, _, luma_at, chroma_at = arguments
        builder, half = emit.builder, rgb.dtype.bitwidth == 16
        roots = []
        for k in range(3):
            place = emit.at(at, (_i64(k), LANES))
            value = emit.load(0, place, _HALVES if half else VECTOR, aligned=False)
            roots.append(_root(emit, builder.fpext(value, VECTOR) if half else value))
        red, green, blue = (_every_third(emit, roots, k) for k in range(3))
        mean = builder.fneg(emit.load(2, entry))
        total, difference = builder.fadd(red, green), builder.fsub(red, green)
        second = builder.fsub(total, builder.fadd(blue, blue))
        luma = emit.call("fma", _all(float(LUMA)), builder.fadd(total, blue), mean)
        emit.store(luma, 4, luma_at)
        emit.store(builder.fmul(_all(float(CHROMA[0, 0])), difference), 4, chroma_at)
        emit.store(
            builder.fmul(_all(float(CHROMA[1, 0])), second), 4, emit.at(chroma_at, (_i64(1), BLOCK))
        )

    return signature, generated(emit_split)


@intrinsic  # type: ignore[untyped-decorator]
def _prefetch(_context: Any, x: Any, at: Any) -> Any:
    return types.void(x, at), generated(lambda emit, arguments: emit.prefetch(0, arguments[1]))


@compiled
def moments(
    rgb: Any, row: Any, count: Any, mean: Any, luma: Any, chroma: Any, parts: Any, luma_sums: Any,
    chroma_sums: Any,
) -> None:  # fmt: skip
    """Add what texels give to the sums, see :class:`nacre.textures.codecs.basis.moments.Moments`.

    Values of `count` texels start `row` elements apart in `rgb`.
    """
    line = _LINE // rgb.itemsize
    blocks, luma_panels, chroma_panels = luma.shape[0], luma.shape[1], chroma.shape[1]
    for block in range(blocks):
        first = block * BLOCK
        for group in range(luma_sums.shape[0]):
            for t in range(ROWS):
                at = min(group * ROWS + t, count - 1) * row + 3 * first
                luma_at, chroma_at = t * BLOCK, (ROWS + 2 * t) * BLOCK
                for k in range(0, BLOCK, LANES):
                    _split(rgb, at + 3 * k, mean, first + k, parts, luma_at + k, chroma_at + k)
                if block + 1 < blocks:
                    for k in range(3 * BLOCK, 6 * BLOCK, line):
                        _prefetch(rgb, at + k)
            for panel in range(luma_panels):
                b_at = (block * luma_panels + panel) * BLOCK * PANEL
                c_at = (group * ROWS * luma_panels + panel) * PANEL
                c_row = luma_panels * PANEL
                wide_tile(parts, 0, luma, b_at, luma_sums, c_at, c_row)
            for panel in range(chroma_panels):
                b_at = (block * chroma_panels + panel) * BLOCK * LANES
                c_at = (group * 2 * ROWS * chroma_panels + panel) * LANES
                c_row = chroma_panels * LANES
                narrow_tile(parts, ROWS * BLOCK, chroma, b_at, chroma_sums, c_at, c_row)
