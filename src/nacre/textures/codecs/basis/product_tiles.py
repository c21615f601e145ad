"""Tiles of matrix products for compiled loops, see :mod:`nacre.compile.emitter`."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from nacre.compile.emitter import ZERO, Emitter, generated
from nacre.compile.vector_code import LANES
from nacre.textures.codecs.basis.tile_sizes import BLOCK, PANEL, ROWS

_i64 = ir.IntType(64)
_UNROLLED = 4  # terms


def _tile(rows: int, panel: int) -> Any:
    """An intrinsic: c[r, f] += sum over BLOCK terms i of x[r, i] b[i, f], for a panel of columns f.

    Rows of x and b lie behind each other, those of c are `c_row` apart.
    """

    @intrinsic  # type: ignore[untyped-decorator]
    def tile(
        _context: Any, x: Any, x_at: Any, b: Any, b_at: Any, c: Any, c_at: Any, c_row: Any
    ) -> Any:
        i = types.intp
        signature = types.void(x, i, b, i, c, i, i)

        def emit_tile(emit: Emitter, arguments: Any) -> None:
            _, x_at, _, b_at, _, c_at, c_row = arguments
            builder = emit.builder
            sums = emit.accumulators(rows, panel // LANES)
            for total in (total for totals in sums for total in totals):
                builder.store(ZERO, total)
            with cgutils.for_range(builder, _i64(BLOCK // _UNROLLED)) as loop:
                for k in range(_UNROLLED):
                    term = emit.at(_i64(k), (loop.index, _UNROLLED))
                    b_row = emit.at(b_at, (term, panel))
                    columns = [
                        emit.load(2, emit.at(b_row, (_i64(v), LANES)))
                        for v in range(panel // LANES)
                    ]
                    for r, totals in enumerate(sums):
                        value = emit.splat(0, builder.add(emit.at(x_at, (_i64(r), BLOCK)), term))
                        for column, total in zip(columns, totals, strict=True):
                            emit.multiply_add(value, column, total)
            for r, totals in enumerate(sums):
                for v, total in enumerate(totals):
                    at = emit.at(c_at, (c_row, r), (_i64(v), LANES))
                    emit.store(builder.fadd(emit.load(4, at), builder.load(total)), 4, at)

        return signature, generated(emit_tile)

    return tile


wide_tile, narrow_tile = _tile(ROWS, PANEL), _tile(2 * ROWS, LANES)
