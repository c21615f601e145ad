"""Machine code for a traced formula: a loop over panels of pairs, a vector register wide.

Every operation is rounded as in IEEE 754 and sums are added up in one order, so that the bits of a
result depend only on the numbers that go in: not on the processor, on the place in an array or on
what is computed beside it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from llvmlite import ir

from nacre.compile.trace import FLOAT, INDEX, MASK, Operation, needed

_f32, _i32, _i64 = ir.FloatType(), ir.IntType(32), ir.IntType(64)
_table = _f32.as_pointer()


def _machine() -> tuple[int, int]:
    """Lanes of a vector register, and registers for the sums of a layer."""
    features = llvm.get_host_cpu_features()
    if features.get("avx512f"):
        return 16, 24
    if features.get("avx"):
        return 8, 12
    return 4, 24 if "neon" in features else 12


LANES, _SUMS = _machine()  # pairs of directions in a panel

_KINDS = {
    FLOAT: ir.VectorType(_f32, LANES),
    INDEX: ir.VectorType(_i32, LANES),
    MASK: ir.VectorType(ir.IntType(1), LANES),
}
_VECTOR = _KINDS[FLOAT]
_COMPARED = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}


_PLACES = ir.VectorType(_table, LANES)


class _Places(ir.Instruction):  # type: ignore[misc]
    """Where the lanes of an index point to in a table, which llvmlite has no instruction for."""

    def __init__(self, block: ir.Block, table: Any, index: Any) -> None:
        super().__init__(block, _PLACES, "getelementptr", [table, index])

    def descr(self, buf: list[str]) -> None:
        table, index = (f"{x.type} {x.get_reference()}" for x in self.operands)
        buf.append(f"getelementptr {_f32}, {table}, {index}\n")


class Program(NamedTuple):
    operations: Sequence[Operation]
    outputs: Sequence[Sequence[int]]
    """Values of every array that comes out: one, or three that lie side by side."""
    fault: int  # the condition that an input is not what it should be


def module(program: Program) -> ir.Module:
    """The function `run(panels, a, b, numbers, tables, outputs)`, which returns whether a pair had
    the fault.

    Inputs are the components of the vectors at a and at b, three floats a vector.
    """
    found = ir.Module("nacre")
    pointers = _table, _table, _table, _table.as_pointer(), _table.as_pointer()
    function = ir.Function(found, ir.FunctionType(_i32, [_i64, *pointers]), "run")
    for argument in function.args[1:]:
        argument.add_attribute("noalias")
    _Loop(function, program).emit()
    return found


class _Loop:
    def __init__(self, function: ir.Function, program: Program) -> None:
        self.function, self.program = function, program
        self.entry = ir.IRBuilder(function.append_basic_block("entry"))
        self.body = ir.IRBuilder(function.append_basic_block("panel"))
        self.values: dict[int, Any] = {}
        self.tables: dict[int, Any] = {}

    def emit(self) -> None:
        program = self.program
        panels, *inputs, _numbers, tables, outputs = self.function.args
        self.table_list = tables
        entry, body = self.entry, self.body
        panel, faults = body.phi(_i64), body.phi(_KINDS[MASK])
        panel.add_incoming(_i64(0), entry.block)
        faults.add_incoming(ir.Constant(_KINDS[MASK], [0] * LANES), entry.block)
        first = body.mul(panel, _i64(3 * LANES))
        self.inputs = [x for pointer in inputs for x in self._split(pointer, first)]
        results = [program.fault, *itertools.chain(*program.outputs)]
        for number in needed(program.operations, results):
            self.values[number] = self._operation(*program.operations[number])
        body = self.body
        for index, numbers in enumerate(program.outputs):
            pointer = entry.load(entry.gep(outputs, [_i64(index)]))
            at = body.mul(panel, _i64(len(numbers) * LANES))
            self._join(pointer, at, [self.values[number] for number in numbers])
        faults.add_incoming(body.or_(faults, self.values[program.fault]), body.block)
        panel.add_incoming(following := body.add(panel, _i64(1)), body.block)
        done = self.function.append_basic_block("done")
        body.cbranch(body.icmp_signed("<", following, panels), panel.parent, done)
        entry.branch(panel.parent)
        end = ir.IRBuilder(done)
        bits = end.bitcast(faults.incomings[1][0], ir.IntType(LANES))
        end.ret(end.zext(end.icmp_unsigned("!=", bits, ir.IntType(LANES)(0)), _i32))

    # Memory

    def _load(self, builder: Any, pointer: Any, offset: Any, kind: Any = _VECTOR) -> Any:
        address = builder.bitcast(builder.gep(pointer, [offset]), kind.as_pointer())
        value = builder.load(address)
        value.align = 4
        return value

    def _splat(self, builder: Any, scalar: Any) -> Any:
        undefined = ir.Constant(_VECTOR, ir.Undefined)
        single = builder.insert_element(undefined, scalar, _i32(0))
        return builder.shuffle_vector(single, undefined, _lanes([0] * LANES))

    def _split(self, pointer: Any, first: Any) -> list[Any]:
        """Components of the vectors of a panel."""
        body = self.body
        parts = [self._load(body, pointer, body.add(first, _i64(k * LANES))) for k in range(3)]
        found = []
        for component in range(3):
            places = [3 * lane + component for lane in range(LANES)]
            low = body.shuffle_vector(parts[0], parts[1], _lanes([p % (2 * LANES) for p in places]))
            both = [lane if p < 2 * LANES else p - LANES for lane, p in enumerate(places)]
            found.append(body.shuffle_vector(low, parts[2], _lanes(both)))
        return found

    def _join(self, pointer: Any, first: Any, values: Sequence[Any]) -> None:
        """Store a value, or three side by side."""
        body, parts = self.body, list(values)
        if len(values) == 3:
            parts = []
            for k in range(3):
                places = [divmod(k * LANES + lane, 3) for lane in range(LANES)]
                low = [lane + LANES * min(which, 1) for lane, which in places]
                pair = body.shuffle_vector(values[0], values[1], _lanes(low))
                both = [lane + LANES if which == 2 else i for i, (lane, which) in enumerate(places)]
                parts.append(body.shuffle_vector(pair, values[2], _lanes(both)))
        for k, part in enumerate(parts):
            place = body.gep(pointer, [body.add(first, _i64(k * LANES))])
            body.store(part, body.bitcast(place, _VECTOR.as_pointer())).align = 4

    def _table(self, number: int) -> Any:
        if number not in self.tables:
            place = self.entry.gep(self.table_list, [_i64(number)])
            self.tables[number] = self.entry.load(place)
        return self.tables[number]

    # Operations

    def _operation(self, kind: str, name: str, *arguments: Any) -> Any:
        body = self.body
        emit: Callable[..., Any] | None = getattr(self, f"_{name}", None)
        if emit is not None:
            return emit(*arguments)
        values = [self.values[number] for number in arguments]
        if name in _COMPARED:
            return self._compared(_COMPARED[name], *values)
        if name in ("min", "max"):
            return self._extremum("<=" if name == "min" else ">=", *values)
        if name == "where":
            return body.select(*values)
        if name in ("and", "or", "not"):
            return getattr(body, f"{name}_")(*values)
        simple = _SIMPLE.get((kind, name)) or _SIMPLE.get((None, name))
        if simple is not None:
            return getattr(body, simple)(*values)
        if name in _CASTS:
            return getattr(body, _CASTS[name])(values[0], _KINDS[kind])
        name = f"llvm.{_INTRINSICS[name]}.v{LANES}f32"
        return body.call(self._function(name, [_VECTOR] * len(values)), values)

    def _function(self, name: str, kinds: Sequence[Any]) -> Any:
        """An instruction that returns floats."""
        module = self.function.module
        known = module.globals.get(name)
        return known or ir.Function(module, ir.FunctionType(_VECTOR, kinds), name)

    def _compared(self, sign: str, a: Any, b: Any) -> Any:
        if a.type == _KINDS[INDEX]:
            return self.body.icmp_signed(sign, a, b)
        compare = self.body.fcmp_unordered if sign == "!=" else self.body.fcmp_ordered
        return compare(sign, a, b)

    def _extremum(self, sign: str, a: Any, b: Any) -> Any:
        """The first where it compares so or is not a number, else the second."""
        compare = self.body.icmp_signed if a.type == _KINDS[INDEX] else self.body.fcmp_unordered
        return self.body.select(compare(sign, a, b), a, b)

    def _input(self, index: int) -> Any:
        return self.inputs[index]

    def _number(self, index: int) -> Any:
        numbers = self.function.args[3]
        return self._splat(self.body, self.body.load(self.body.gep(numbers, [_i64(index)])))

    _datum = _number

    def _literal(self, value: str) -> Any:
        return ir.Constant(_VECTOR, [float(value)] * LANES)

    def _whole(self, value: int) -> Any:
        return ir.Constant(_KINDS[INDEX], [value] * LANES)

    def _take(self, table: int, index: int) -> Any:
        body, everywhere = self.body, ir.Constant(_KINDS[MASK], [1] * LANES)
        places = _Places(body.block, self._table(table), self.values[index])
        body._insert(places)
        suffix = "p0" if str(_table) == "ptr" else "p0f32"
        kinds = _PLACES, _i32, _KINDS[MASK], _VECTOR
        gather = self._function(f"llvm.masked.gather.v{LANES}f32.v{LANES}{suffix}", kinds)
        undefined = ir.Constant(_VECTOR, ir.Undefined)
        return body.call(gather, [places, _i32(4), everywhere, undefined])

    def _output(self, layer: int, row: int) -> Any:
        return self.values[layer][row]

    def _dense(self, weights: int, biases: int, rows: int, inputs: Sequence[int]) -> list[Any]:
        """Sums of a layer: as many at a time as there are registers."""
        count = _i64(len(inputs))
        held = self.entry.alloca(_VECTOR, len(inputs))
        held.align = 4 * LANES
        for k, number in enumerate(inputs):
            self.body.store(self.values[number], self.body.gep(held, [_i64(k)]))
        matrix, constants = self._table(weights), self._table(biases)
        tiles = math.ceil(rows / _SUMS)
        bounds = [rows * tile // tiles for tile in range(tiles + 1)]
        sums: list[Any] = []
        for low, high in itertools.pairwise(bounds):
            body = self.body
            starts = [
                self._splat(body, body.load(body.gep(constants, [_i64(row)])))
                for row in range(low, high)
            ]
            before = body.block
            loop = ir.IRBuilder(self.function.append_basic_block("input"))
            body.branch(loop.block)
            k = loop.phi(_i64)
            totals = [loop.phi(_VECTOR) for _ in starts]
            value = loop.load(loop.gep(held, [k]))
            at = loop.mul(k, _i64(rows))
            fma = self._function(f"llvm.fma.v{LANES}f32", [_VECTOR] * 3)
            results = []
            for row, total in zip(range(low, high), totals, strict=True):
                scalar = loop.load(loop.gep(matrix, [loop.add(at, _i64(row))]))
                results.append(loop.call(fma, [self._splat(loop, scalar), value, total]))
            k.add_incoming(_i64(0), before)
            k.add_incoming(following := loop.add(k, _i64(1)), loop.block)
            for start, total, result in zip(starts, totals, results, strict=True):
                total.add_incoming(start, before)
                total.add_incoming(result, loop.block)
            self.body = ir.IRBuilder(self.function.append_basic_block("after"))
            loop.cbranch(loop.icmp_signed("<", following, count), loop.block, self.body.block)
            sums.extend(results)
        return sums


_SIMPLE = {
    (FLOAT, "add"): "fadd", (FLOAT, "sub"): "fsub", (FLOAT, "mul"): "fmul", (FLOAT, "div"): "fdiv",
    (FLOAT, "neg"): "fneg", (INDEX, "add"): "add", (INDEX, "sub"): "sub", (INDEX, "mul"): "mul",
    (None, "xor"): "xor", (None, "shl"): "shl", (None, "shr"): "ashr",
}  # fmt: skip
_CASTS = {"bits": "bitcast", "from_bits": "bitcast", "to_float": "sitofp", "truncate": "fptosi"}
_INTRINSICS = {"fma": "fma", "sqrt": "sqrt", "floor": "floor", "abs": "fabs"}


def _lanes(places: Sequence[int]) -> Any:
    return ir.Constant(ir.VectorType(_i32, len(places)), list(places))
