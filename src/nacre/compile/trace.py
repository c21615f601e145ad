"""Formulas on components, written down: what each library computes, as a list of operations.

A formula that is called with the :class:`Traced` inputs of a :class:`Trace` adds its operations to
that list, once each. Numbers in the formula stay apart from its operations, so that materials that
differ only in their numbers share compiled code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partialmethod
from typing import Any, TypeAlias

import numpy as np

from nacre.array import LIBRARIES, Array, Namespace, Table, Weights
from nacre.compile import elementary
from nacre.compile.data import Datum, computed

FLOAT, INDEX, MASK = "float", "index", "mask"
"""Kinds of values: float32, int32, and truth."""

Operation: TypeAlias = tuple[Any, ...]
"""Kind of the value, name, then values by number, and what else the name needs."""

Formulas: TypeAlias = Mapping[str, Callable[..., Any]]
"""What elementary functions are made of, by their names in :class:`nacre.array.Namespace`."""

_MAX_OPERATIONS = 10_000  # of a formula: they compile in about a second
_NUMBERS = "number", "datum", "literal", "whole"
_LEAVES = "input", *_NUMBERS
_LARGEST_INDEX = float(1 << 30)


class UntraceableError(TypeError):
    """A formula asks for something that is not known about a value before it is computed."""


class Trace:
    """The operations of a formula so far.

    `expanded` says what exponentials, logarithms and circular functions are made of; those that are
    missing are operations themselves. :attr:`operations` compute each value. :attr:`numbers` are
    those in the formula, in the order of their first use, and :attr:`origins` tell where those that
    are data (:class:`nacre.compile.data.Datum`) come from, by place. :attr:`tables` are flat arrays
    that it gathers from, and weights of layers.
    """

    def __init__(self, *, expanded: Formulas = elementary.FUNCTIONS) -> None:
        self.expanded = expanded
        self.operations: list[Operation] = []
        self.numbers: list[float] = []
        self.origins: dict[int, Any] = {}
        self.tables: list[Weights] = []
        self._known: dict[Operation, int] = {}

    def input(self, index: int) -> Traced:
        """The component with this number."""
        return self.add(FLOAT, "input", index)

    def add(self, kind: str, name: str, *arguments: Any) -> Traced:
        values = (x.number if isinstance(x, Traced) else x for x in arguments)
        operation = (kind, name, *values)
        number = self._known.setdefault(operation, len(self.operations))
        if number == _MAX_OPERATIONS:
            raise UntraceableError("so long a formula would take too long to compile")
        if number == len(self.operations):
            self.operations.append(operation)
        return Traced(self, number, kind)

    def number(self, value: float) -> Traced:
        """A number in the formula, which is data of the compiled code."""
        single = float(np.float32(value))
        # Two numbers that happen to be equal are two in a material, but one in a formula.
        known = ("datum", value.origin) if isinstance(value, Datum) else ("number", str(single))
        if known not in self._known:
            self._known[known] = len(self.numbers)
            if isinstance(value, Datum):
                self.origins[len(self.numbers)] = value.origin
            self.numbers.append(single)
        return self.add(FLOAT, known[0], self._known[known])

    def literal(self, value: float) -> Traced:
        """A number that all formulas share, which is part of the compiled code."""
        return self.add(FLOAT, "literal", repr(float(np.float32(value))))  # as text nan equals nan

    def index(self, value: int) -> Traced:
        """A whole number, part of the compiled code."""
        return self.add(INDEX, "whole", int(value))

    def table(self, values: Weights) -> int:
        """Which of :attr:`tables` holds these values."""
        for number, table in enumerate(self.tables):
            if table.ctypes.data == values.ctypes.data and table.size == values.size:
                return number
        self.tables.append(values)
        return len(self.tables) - 1

    def as_value(self, value: Any, kind: str) -> Traced:
        """A number, or a value of this trace, as one of a kind."""
        if isinstance(value, Traced):
            if value.trace is not self or value.kind != kind:
                raise UntraceableError(f"a {value.kind} stands where a {kind} should")
            return value
        if not isinstance(value, (bool, int, float, np.number)):
            raise UntraceableError(f"{type(value).__name__} is neither a value nor a number")
        if kind == INDEX:
            return self.index(int(value))
        if kind == FLOAT:
            return self.number(value if isinstance(value, float) else float(value))
        raise UntraceableError("a number stands where a condition should")

    def constant(self, value: Traced) -> float | None:
        """The number that a value always is, if it is one."""
        _, name, *arguments = self.operations[value.number]
        if name == "number":
            return self.numbers[arguments[0]]
        return float(arguments[0]) if name in ("whole", "literal") else None


class Traced:
    """A value that a formula computes: float32, an index, or a condition."""

    __slots__ = ("kind", "number", "trace")
    __array_ufunc__ = None  # NumPy's numbers leave operators to this class

    def __init__(self, trace: Trace, number: int, kind: str) -> None:
        self.trace, self.number, self.kind = trace, number, kind

    def _binary(self, name: str, other: Any, swapped: bool = False) -> Any:
        fraction = isinstance(other, (float, np.floating)) or name == "div"
        if self.kind == INDEX and fraction:
            return NotImplemented
        try:
            value = self.trace.as_value(other, self.kind)
        except UntraceableError:
            return NotImplemented
        return arithmetic(name, *((value, self) if swapped else (self, value)))

    __add__ = partialmethod(_binary, "add")
    __radd__ = partialmethod(_binary, "add", swapped=True)
    __sub__ = partialmethod(_binary, "sub")
    __rsub__ = partialmethod(_binary, "sub", swapped=True)
    __mul__ = partialmethod(_binary, "mul")
    __rmul__ = partialmethod(_binary, "mul", swapped=True)
    __truediv__ = partialmethod(_binary, "div")
    __rtruediv__ = partialmethod(_binary, "div", swapped=True)

    def __neg__(self) -> Any:
        return self.trace.add(FLOAT, "neg", self) if self.kind == FLOAT else 0 - self

    def __pow__(self, power: Any) -> Any:
        if type(power) is not int or not 1 <= power <= 8 or self.kind != FLOAT:
            return NotImplemented
        half = self ** (power // 2) if power > 1 else self
        return self if power == 1 else half * half * self if power % 2 else half * half

    def _compare(self, name: str, other: Any) -> Traced:
        return self.trace.add(MASK, name, self, self.trace.as_value(other, self.kind))

    __lt__ = partialmethod(_compare, "lt")
    __le__ = partialmethod(_compare, "le")
    __gt__ = partialmethod(_compare, "gt")
    __ge__ = partialmethod(_compare, "ge")
    __eq__ = partialmethod(_compare, "eq")
    __ne__ = partialmethod(_compare, "ne")
    __hash__ = None  # type: ignore[assignment]

    def _bitwise(self, name: str, other: Any) -> Any:
        return self.trace.add(self.kind, name, self, self.trace.as_value(other, self.kind))

    __and__ = partialmethod(_bitwise, "and")
    __or__ = partialmethod(_bitwise, "or")
    __xor__ = partialmethod(_bitwise, "xor")
    __lshift__ = partialmethod(_bitwise, "shl")
    __rshift__ = partialmethod(_bitwise, "shr")

    def __invert__(self) -> Traced:
        return self.trace.add(MASK, "not", self.trace.as_value(self, MASK))

    def __bool__(self) -> bool:
        raise UntraceableError("a condition is not known before it is computed")

    def __float__(self) -> float:
        raise UntraceableError("a value is not known before it is computed")

    __int__ = __index__ = __float__

    def __iter__(self) -> Iterator[Any]:
        raise UntraceableError("a value has no parts")


def arithmetic(name: str, a: Traced, b: Traced) -> Traced:
    """A sum, difference, product or quotient, without what cannot change it."""
    trace = a.trace
    left, right = trace.constant(a), trace.constant(b)
    if (name == "mul" and left == 1.0) or (name == "add" and left == 0.0):
        return b
    if (name in ("mul", "div") and right == 1.0) or (name in ("add", "sub") and right == 0.0):
        return a
    # The way in which formulas give a number the shape of a value.
    if name == "mul" and 0.0 in (left, right):
        return a if left == 0.0 else b
    return trace.add(a.kind, name, a, b)


def sources(operation: Operation) -> Sequence[int]:
    """Numbers of the values that an operation takes."""
    _, name, *arguments = operation
    if name == "dense":
        return list(arguments[3])
    if name == "take":
        return arguments[1:]
    if name == "output":
        return arguments[:1]
    return [] if name in _LEAVES else arguments


def needed(
    operations: Sequence[Operation] | Mapping[int, Operation], results: Iterable[int]
) -> list[int]:
    """Numbers of the values that results come from, in order."""
    seen: set[int] = set()
    left = list(results)
    while left:
        number = left.pop()
        if number not in seen:
            seen.add(number)
            left.extend(sources(operations[number]))
    return sorted(seen)


class _Tracing(Namespace):
    """The functions in formulas; for plain numbers they return plain numbers."""

    library = "trace"

    def __init__(self) -> None:
        for name in ("sqrt", "floor", "abs"):
            setattr(self, name, _function(name, _operation(name)))
        for name in ("exp", "log", "sin", "cos", "arcsin", "arctan2"):
            setattr(self, name, _function(name, _elementary(name)))
        for name in ("minimum", "maximum"):
            setattr(self, name, _extremum(name))
        self.where, self.to_index = _where, _to_index
        self.to_float, self.take = _to_float, _take

    def dense(self, values: Sequence[Array], weights: Weights, biases: Weights) -> list[Array]:
        trace = _trace(*values)
        inputs = [trace.as_value(value, FLOAT) for value in values]
        used = [i for i, value in enumerate(inputs) if trace.constant(value) != 0.0] or [0]
        if len(used) < len(inputs):
            weights = np.ascontiguousarray(weights[used])
        tables = trace.table(weights.reshape(-1)), trace.table(biases)
        numbers = tuple(inputs[i].number for i in used)
        layer = trace.add("layer", "dense", *tables, len(biases), numbers)
        return [trace.add(FLOAT, "output", layer, row) for row in range(len(biases))]


def _trace(*values: Any) -> Trace:
    return next(value.trace for value in values if isinstance(value, Traced))


def _function(name: str, traced: Callable[..., Traced]) -> Callable[..., Any]:
    """A function of floats, some of which may be plain numbers."""
    plain = getattr(np, name)

    def call(*values: Any) -> Any:
        if not any(isinstance(value, Traced) for value in values):
            return computed(name, plain, *values)
        trace = _trace(*values)
        return traced(*(trace.as_value(value, FLOAT) for value in values))

    return call


def _operation(name: str) -> Callable[[Traced], Traced]:
    return lambda x: x.trace.add(FLOAT, name, x)


def _elementary(name: str) -> Callable[..., Traced]:
    def call(*values: Traced) -> Traced:
        trace = values[0].trace
        formula = trace.expanded.get(name)
        return formula(*values) if formula else trace.add(FLOAT, name, *values)

    return call


def _extremum(name: str) -> Callable[[Any, Any], Any]:
    least = name == "minimum"
    plain = min if least else max

    def call(a: Any, b: Any) -> Any:
        kinds = [x.kind for x in (a, b) if isinstance(x, Traced)]
        if not kinds:
            whole = isinstance(a, int) and isinstance(b, int)
            return plain(a, b) if whole else computed(name, plain, a, b)
        trace = _trace(a, b)
        a, b = trace.as_value(a, kinds[0]), trace.as_value(b, kinds[0])
        # A NaN on the left stays one.
        pair = (b, a) if trace.operations[a.number][1] in _NUMBERS else (a, b)
        return trace.add(kinds[0], plain.__name__, *pair)

    return call


def _where(condition: Any, a: Any, b: Any) -> Any:
    if not isinstance(condition, Traced):
        return a if condition else b
    kinds = {x.kind for x in (a, b) if isinstance(x, Traced)} or {
        INDEX if isinstance(a, int) and isinstance(b, int) else FLOAT
    }
    trace, kind = condition.trace, kinds.pop()
    a, b = trace.as_value(a, kind), trace.as_value(b, kind)
    return a if a.number == b.number else trace.add(kind, "where", condition, a, b)


def _to_index(x: Any) -> Any:
    positive = _where(x > 0.0, x, 0.0)  # also for NaN
    return x.trace.add(INDEX, "truncate", _extremum("minimum")(positive, _LARGEST_INDEX))


def _to_float(index: Any, like: Traced) -> Traced:
    return like.trace.add(FLOAT, "to_float", like.trace.as_value(index, INDEX))


def _take(table: Table, index: Traced) -> Traced:
    trace = index.trace
    return trace.add(FLOAT, "take", trace.table(table.values.reshape(-1)), index)


LIBRARIES["nacre"] = _Tracing
