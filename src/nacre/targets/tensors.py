"""Functions as steps on tensors: a row for each value, a column for each pair of directions.

The sums of a layer form one tensor, and so does what is done to all of them alike; everything else
is computed in single rows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.compile.trace import FLOAT, INDEX, sources
from nacre.targets.program import Function

Constants: TypeAlias = npt.NDArray[Any]
"""One number, or one per row: float32, or int32 for indices."""
Operand: TypeAlias = "int | Constants"
"""The index of an earlier step, or constants."""

_APART = frozenset(("input", "dense", "take"))  # operations that do not work on many rows at once
_FOLDED: Mapping[str, Callable[..., Any]] = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative,
    "min": np.minimum, "max": np.maximum, "sqrt": np.sqrt, "exp": np.exp, "log": np.log,
    "truncate": np.trunc, "to_float": np.float32,
}  # fmt: skip
"""Operations that are evaluated at export if their operands are constants."""


@dataclass(frozen=True)
class Step:
    """One tensor of shape (rows, n).

    Parameters
    ----------
    kind, name
        As in operations (see :mod:`nacre.compile.trace`), or "input", a parameter of the function;
        "row", one row of a tensor; "stack", rows as one tensor.
    row
        For "row": its index.
    parameter
        For "input": its name.
    tables
        For "take", the values, shape (values,); for "dense", weights (inputs, rows) and biases
        (rows,).
    """

    kind: str
    name: str
    rows: int
    operands: tuple[Operand, ...] = ()
    row: int = 0
    parameter: str = ""
    tables: tuple[Weights, ...] = ()


@dataclass(frozen=True)
class Steps:
    """A function as tensors in order; results are indices of steps, by name."""

    steps: Sequence[Step]
    results: Mapping[str, int]


def steps(function: Function) -> Steps:
    """The steps that compute a function."""
    made = _Builder(function)
    return Steps(made.steps, {name: made.place(v) for name, v in function.results.items()})


def compact(values: Weights) -> npt.NDArray[np.floating]:
    """Weights, in half precision if that holds them exactly."""
    with np.errstate(over="ignore"):
        half = values.astype(np.float16)
    return half if np.array_equal(half, values) else values


class _Builder:
    def __init__(self, function: Function) -> None:
        self.steps: list[Step] = []
        self._function = function
        self._places: dict[Any, int] = {}
        self._alike: dict[tuple[int, ...], bool] = {}
        self._numbers: dict[int, float | None] = {}
        for value in sorted(function.operations):
            self._numbers[value] = self._known(value)
        for name, count in function.parameters.items():
            self._places[name] = self._add(Step(FLOAT, "input", count, parameter=name))
        wanted: set[tuple[int, ...]] = set()
        left = [tuple(values) for values in function.results.values()]
        while left:
            values = left.pop()
            if values not in wanted:
                wanted.add(values)
                left.extend(self._before(values))
        # Operands have smaller numbers than their results.
        for values in sorted(wanted, key=lambda values: (max(values), len(values))):
            self._places[values] = self._made(values)

    def place(self, values: Sequence[int]) -> int:
        return self._places[tuple(values)]

    def _add(self, step: Step) -> int:
        self.steps.append(step)
        return len(self.steps) - 1

    def _before(self, values: tuple[int, ...]) -> list[tuple[int, ...]]:
        """What values are computed from, apart from constants."""
        operations = [self._function.operations[value] for value in values]
        name = operations[0][1]
        if len(values) > 1 and not self._is_one(values):
            return [(value,) for value in values]
        if name in ("input", "output"):
            return [] if name == "input" else [(operations[0][2],)]
        if name == "dense":
            whole = tuple(v for v in operations[0][5] if self._numbers[v] is None)
            return [whole] if whole else []
        columns = zip(*map(sources, operations), strict=True)
        items = (column[:1] if len(set(column)) == 1 else column for column in columns)
        return [item for item in items if self._constants(item) is None]

    def _is_one(self, values: tuple[int, ...]) -> bool:
        """Whether values form one tensor: a layer, or what is done to its sums alike."""
        if values not in self._alike:
            distinct = len(set(values)) == len(values)  # otherwise a tensor would have too few rows
            self._alike[values] = len(values) == 1 or (distinct and self._isomorphic(values))
        return self._alike[values]

    def _isomorphic(self, values: tuple[int, ...]) -> bool:
        operations = [self._function.operations[value] for value in values]
        kind, name, *arguments = operations[0]
        if any(operation[:2] != (kind, name) for operation in operations) or name in _APART:
            return False
        if name == "output":
            count = self._function.operations[arguments[0]][4]
            rows = [operation[2:] for operation in operations]
            return rows == [(arguments[0], row) for row in range(count)]
        columns = list(zip(*map(sources, operations), strict=True))
        return bool(columns) and all(
            len(set(column)) == 1 or self._constants(column) is not None or self._is_one(column)
            for column in columns
        )

    def _constants(self, values: tuple[int, ...]) -> Constants | None:
        """The constants that values are, or None; a single one if all are equal."""
        found = [self._numbers[value] for value in values]
        if None in found:
            return None
        whole = self._function.operations[values[0]][0] == INDEX
        kept = found[:1] if len(set(found)) == 1 else found
        return np.array(kept, np.int32 if whole else np.float32)

    def _known(self, value: int) -> float | None:
        """The constant that a value is, also if computed from constants alone."""
        operation = self._function.operations[value]
        given = [self._numbers[source] for source in sources(operation)]
        numbers = [np.float32(number) for number in given if number is not None]
        if not given or len(numbers) < len(given):
            return self._function.number(value)
        if operation[1] == "take":
            return float(self._function.tables[operation[2]][int(numbers[0])])
        return float(_FOLDED[operation[1]](*numbers)) if operation[1] in _FOLDED else None

    def _made(self, values: tuple[int, ...]) -> int:
        """A step for values whose operands have theirs."""
        constants = self._constants(values)
        if constants is not None:
            return self._repeated(constants, len(values))
        if not self._is_one(values):
            parts = tuple(self._places[(value,)] for value in values)
            return self._add(Step(FLOAT, "stack", len(values), parts))
        kind, name, *arguments = self._function.operations[values[0]]
        if name == "input":
            parameter, row = self._function.parameter(arguments[0])
            return self._add(Step(FLOAT, "row", 1, (self._places[parameter],), row))
        if name == "output":
            layer = self._places[(arguments[0],)]
            if len(values) == self.steps[layer].rows:
                return layer
            return self._add(Step(FLOAT, "row", 1, (layer,), arguments[1]))
        if name == "dense":
            return self._layer(*arguments)
        operations = [self._function.operations[value] for value in values]
        operands: list[Operand] = []
        for column in zip(*map(sources, operations), strict=True):
            constants = self._constants(column)
            item = column[:1] if len(set(column)) == 1 else column
            operands.append(self._places[item] if constants is None else constants)
        if name == "mul" and self._is_relu(operands[0], operands[1]):
            operands[1] = operands[0]  # max(x, 0) x is max(x, 0)^2, and the sums x are not kept
        tables = (self._function.tables[arguments[0]],) if name == "take" else ()
        return self._add(Step(kind, name, len(values), tuple(operands), tables=tables))

    def _is_relu(self, one: Operand, of: Operand) -> bool:
        """Whether a step is max(x, 0) of another step x."""
        if not (isinstance(one, int) and isinstance(of, int)) or self.steps[one].name != "max":
            return False
        value, bound = self.steps[one].operands
        return (
            isinstance(value, int)
            and value == of
            and not isinstance(bound, int)
            and not bound.any()
        )

    def _repeated(self, constants: Constants, rows: int) -> int:
        """Constants in every column: a result that depends on nothing."""
        row = self._add(Step(FLOAT, "row", 1, (0,)))
        zero = self._add(Step(FLOAT, "mul", 1, (row, np.zeros(1, np.float32))))
        return self._add(Step(FLOAT, "add", rows, (zero, constants)))

    def _layer(self, weights: int, biases: int, rows: int, inputs: Sequence[int]) -> int:
        """A layer; constant inputs are added to its biases."""
        matrix = self._function.tables[weights].reshape(len(inputs), rows)
        numbers = [self._numbers[value] for value in inputs]
        known = np.array([0.0 if number is None else number for number in numbers])
        constants = (self._function.tables[biases] + known @ matrix).astype(np.float32)
        kept = [index for index, number in enumerate(numbers) if number is None]
        if not kept:
            return self._repeated(constants, rows)
        operand = self._places[tuple(inputs[k] for k in kept)]
        tables = matrix[kept], constants
        return self._add(Step(FLOAT, "dense", rows, (operand,), tables=tables))
