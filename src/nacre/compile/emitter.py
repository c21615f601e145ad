"""Vector instructions as LLVM IR inside Numba functions, whose own loops may not become them.

Arrays are flat and 64-byte aligned, of float32 unless a vector has another type. Offsets count
elements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from nacre.compile.vector_code import LANES

_f32 = ir.FloatType()
_i64 = ir.IntType(64)
VECTOR = ir.VectorType(_f32, LANES)
ZERO = ir.Constant(VECTOR, [0.0] * LANES)


class Emitter:
    """Instructions on the arrays among the arguments of an intrinsic, known by their positions."""

    def __init__(self, context: Any, builder: Any, signature: Any, arguments: Sequence[Any]):
        self.builder = builder
        self.pointers = {
            index: context.make_array(kind)(context, builder, arguments[index]).data
            for index, kind in enumerate(signature.args)
            if isinstance(kind, types.Array)
        }

    def at(self, base: Any, *terms: tuple[Any, int]) -> Any:
        """Offset `base` plus the sum of value * constant."""
        for value, constant in terms:
            base = self.builder.add(base, self.builder.mul(value, _i64(constant)))
        return base

    def load(self, array: int, offset: Any, kind: Any = VECTOR, *, aligned: bool = True) -> Any:
        address = self.builder.gep(self.pointers[array], [offset])
        value = self.builder.load(self.builder.bitcast(address, kind.as_pointer()))
        value.align = 4 * kind.count if aligned else 1
        return value

    def store(self, value: Any, array: int, offset: Any) -> None:
        address = self.builder.gep(self.pointers[array], [offset])
        kind = value.type
        operation = self.builder.store(value, self.builder.bitcast(address, kind.as_pointer()))
        operation.align = 4 * kind.count

    def splat(self, array: int, offset: Any) -> Any:
        """The scalar at an offset in every lane."""
        scalar = self.builder.load(self.builder.gep(self.pointers[array], [offset]))
        undefined = ir.Constant(VECTOR, ir.Undefined)
        single = self.builder.insert_element(undefined, scalar, ir.IntType(32)(0))
        lanes = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return self.builder.shuffle_vector(single, undefined, lanes)

    def accumulators(self, rows: int, columns: int) -> list[list[Any]]:
        """Variables that LLVM promotes to registers."""
        return [
            [cgutils.alloca_once(self.builder, VECTOR) for _ in range(columns)] for _ in range(rows)
        ]

    def multiply_add(self, a: Any, b: Any, accumulator: Any) -> None:
        total = self.call("fma", a, b, self.builder.load(accumulator))
        self.builder.store(total, accumulator)

    def call(self, name: str, *vectors: Any) -> Any:
        """An operation of LLVM on vectors: fma, sqrt."""
        function = cgutils.get_or_insert_function(
            self.builder.module,
            ir.FunctionType(VECTOR, [VECTOR] * len(vectors)),
            f"llvm.{name}.v{LANES}f32",
        )
        return self.builder.call(function, vectors)

    def sums(self, vectors: Sequence[Any]) -> list[Any]:
        """Sums over the lanes of vectors, as lanes of as few vectors as hold them.

        Pairs of vectors are added half against half until every lane is a sum, which takes a third
        of the instructions of summing one vector after the other.
        """
        level = [*vectors, *[ZERO] * (-len(vectors) % LANES)]
        width = LANES
        while width > 1:
            half = width // 2
            low = [g * width + j for g in range(2 * LANES // width) for j in range(half)]
            parts = [
                ir.Constant(ir.VectorType(ir.IntType(32), LANES), [i + shift for i in low])
                for shift in (0, half)
            ]
            level = [
                self.builder.fadd(*(self.builder.shuffle_vector(a, b, part) for part in parts))
                for a, b in zip(level[::2], level[1::2], strict=True)
            ]
            width = half
        return level

    def prefetch(self, array: int, offset: Any) -> None:
        """Ask for the cache line of an element, into the second-level cache."""
        byte, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
        function = cgutils.get_or_insert_function(
            self.builder.module,
            ir.FunctionType(ir.VoidType(), [byte, flag, flag, flag]),
            "llvm.prefetch.p0",
        )
        address = self.builder.bitcast(self.builder.gep(self.pointers[array], [offset]), byte)
        self.builder.call(function, [address, flag(0), flag(2), flag(1)])


def generated(emit: Callable[[Emitter, Any], None]) -> Callable[..., Any]:
    """The code of an intrinsic without a value, as Numba takes it."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        emit(Emitter(context, builder, signature, arguments), arguments)
        return context.get_dummy_value()

    return generate
