"""Functions split at their layers, for languages with loops.

A layer is a loop, and so is what follows its sums element by element.
"""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from nacre.array import Weights
from nacre.compile.trace import FLOAT, Operation, needed, sources
from nacre.targets.program import Function


@dataclass(frozen=True)
class Straight:
    """A function without layers; its inputs and outputs other than directions are arrays."""

    function: Function


@dataclass(frozen=True)
class Units:
    """A function that maps each of `count` numbers in an array to one in another.

    Its parameter and its result are named like the arrays.
    """

    count: int
    function: Function


@dataclass(frozen=True)
class Sums:
    """A layer: the array `target` is `source @ weights + biases`.

    Weights and biases have shapes (inputs, sums) and (sums,).
    """

    source: str
    target: str
    weights: Weights
    biases: Weights


Stage: TypeAlias = Straight | Units | Sums


def stages(function: Function) -> list[Stage]:
    """The steps of a function, in order.

    Arrays `x1`, `x2` ... hold inputs of layers, and `s1`, `s2` ... their sums.
    """
    operations = function.operations
    layers = [n for n, operation in operations.items() if operation[1] == "dense"]
    arrays = {f"s{index}": operations[n][4] for index, n in enumerate(layers, 1)}
    whole = replace(
        function,
        parameters={**function.parameters, **arrays},
        operations=_with_inputs(operations, layers, sum(function.parameters.values())),
    )
    found: list[Stage] = []
    for index, number in enumerate(layers, 1):
        weights, biases, rows, inputs = operations[number][2:]
        array, before = f"x{index}", f"s{index - 1}"
        unit = _unit(whole, inputs, before) if len(inputs) == arrays.get(before) else None
        if unit:
            found.append(Units(len(inputs), replace(unit, results={array: inputs[:1]})))
        else:
            found.append(Straight(replace(whole, results={array: inputs})))
        matrix = function.tables[weights].reshape(len(inputs), rows)
        found.append(Sums(array, f"s{index}", matrix, function.tables[biases]))
    return [*found, Straight(whole)]


def _with_inputs(
    operations: Mapping[int, Operation], layers: Sequence[int], first: int
) -> Mapping[int, Operation]:
    """Operations that find the sums of layers among the inputs, from number `first` on."""
    counts = [operations[n][4] for n in layers]
    starts = dict(zip(layers, itertools.accumulate([first, *counts]), strict=False))

    def rewritten(operation: Operation) -> Operation:
        if operation[1] != "output":
            return operation
        return FLOAT, "input", starts[operation[2]] + operation[3]

    return {
        number: rewritten(operation)
        for number, operation in operations.items()
        if operation[1] != "dense"
    }


def _unit(function: Function, values: Sequence[int], array: str) -> Function | None:
    """The function that maps each number in an array to the value at its index, if there is one."""
    forms = {_form(function, value, array, index) for index, value in enumerate(values)}
    if len(forms) > 1 or None in forms:
        return None
    first = {
        number: (FLOAT, "input", 0) if operation[1] == "input" else operation
        for number, operation in function.operations.items()
    }
    return replace(function, parameters={array: 1}, operations=first)


def _form(function: Function, value: int, array: str, index: int) -> Hashable:
    """The formula for a value in terms of one number in an array, independent of the index.

    None if it depends on anything else.
    """
    names: dict[int, Hashable] = {}
    form: list[Hashable] = []
    for number in needed(function.operations, [value]):
        kind, name, *arguments = function.operations[number]
        constant = function.number(number)
        if name == "input" and function.parameter(arguments[0]) == (array, index):
            names[number] = array
        elif constant is not None:
            names[number] = str(constant)  # as text nan equals nan
        elif not (used := sources(function.operations[number])):
            return None
        else:
            names[number] = len(form)
            form.append((kind, name, *(names[n] for n in used)))
    return tuple(form), names[value]
