"""The arithmetic floor: fused multiply-adds a second that one core reaches from registers."""

from __future__ import annotations

import time
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from nacre.neural.tiles import LANES

_CHAINS = 12
"""Independent sums: latency of four cycles times up to two units, with some to spare."""


@intrinsic
def _chains(_context: Any, x: Any, count: Any) -> Any:
    """Run `count` rounds of a multiply-add on every chain; returns one lane of their sum."""

    def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        kind = ir.VectorType(ir.FloatType(), LANES)
        undefined = ir.Constant(kind, ir.Undefined)
        single = builder.insert_element(undefined, arguments[0], ir.IntType(32)(0))
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        value = builder.shuffle_vector(single, undefined, zeros)
        fma = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(kind, [kind] * 3), f"llvm.fma.v{LANES}f32"
        )
        sums = [cgutils.alloca_once_value(builder, value) for _ in range(_CHAINS)]
        with cgutils.for_range(builder, arguments[1]):
            for total in sums:
                builder.store(builder.call(fma, [builder.load(total), value, value]), total)
        total = builder.load(sums[0])
        for other in sums[1:]:
            total = builder.fadd(total, builder.load(other))
        return builder.extract_element(total, ir.IntType(32)(0))

    return types.float32(x, count), generate


@numba.njit(nogil=True)
def _run(x: Any, count: Any) -> Any:
    return _chains(x, count)


def peak(seconds: float = 0.05) -> float:
    """Fused multiply-adds a second of one core, float32."""
    rounds = 1_000_000
    _run(np.float32(0.5), rounds)
    best, spent = 0.0, 0.0
    while spent < seconds:
        start = time.perf_counter()
        _run(np.float32(0.5), rounds)
        passed = time.perf_counter() - start
        best = max(best, rounds * _CHAINS * LANES / passed)
        spent += passed
    return best
