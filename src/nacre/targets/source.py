"""Functions as source text for languages with the syntax of C.

A value that is used once is written where it is used. Four sums of a layer may form one vector, and
so may what follows them element by element; weights are literals.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, TypeAlias

import numpy as np

from nacre.array import Weights
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.compile.trace import FLOAT, INDEX, MASK, Formulas, sources
from nacre.errors import NacreError
from nacre.targets.program import NATIVE, Function, program
from nacre.targets.target import TABLES, WIDE, Target, other
from nacre.targets.text import preamble, shortest

Item: TypeAlias = int | tuple[int, ...]
"""A value, or up to four that are a vector."""

_UNIT_BY_UNIT = frozenset(("add", "sub", "mul", "div", "neg", "min", "max", "exp", "abs", "sqrt"))
_LONGEST = 80  # characters of an expression that is written where it is used
_BINDING = {"add": 1, "sub": 1, "mul": 2, "div": 2}
_WEAKEST, _STRONGEST = 0, 9  # of everything else in parentheses, and of names and calls
_AXES = "xyzw"
_LARGEST = float(np.finfo(np.float32).max)


class Language:
    """How a language writes values; a subclass changes what differs from GLSL."""

    types: ClassVar[Mapping[str, str]] = {FLOAT: "float", INDEX: "int", MASK: "bool"}
    vectors: ClassVar[str] = "vec{}"
    """Type of a vector with some count of floats; empty if there are no vectors."""
    packed: ClassVar[bool] = True
    """Whether four sums of a layer form one vector, if there are vectors."""
    expanded: ClassVar[Formulas] = NATIVE
    """Elementary functions composed of others; see :class:`nacre.compile.trace.Trace`."""
    comment: ClassVar[str] = "// "
    operations: ClassVar[Mapping[str, str]] = {
        "add": "{0} + {1}", "sub": "{0} - {1}", "mul": "{0} * {1}", "div": "{0} / {1}",
        "neg": "-{0}", "lt": "{0} < {1}", "le": "{0} <= {1}", "gt": "{0} > {1}", "ge": "{0} >= {1}",
        "eq": "{0} == {1}", "ne": "{0} != {1}", "and": "{0} && {1}", "or": "{0} || {1}",
        "not": "!{0}", "where": "{0} ? {1} : {2}", "min": "min({0}, {1})", "max": "max({0}, {1})",
        "sqrt": "sqrt({0})", "floor": "floor({0})", "abs": "abs({0})", "exp": "exp({0})",
        "log": "log({0})", "sin": "sin({0})", "cos": "cos({0})", "arcsin": "asin({0})",
        "arctan2": "atan({0}, {1})",
    }  # fmt: skip
    """Text of each operation; those on whole numbers have names such as "index add"."""
    max_weights: ClassVar[float] = 10_000
    """Limit on literals in layers. Compilers take seconds for them; for twice as many, Mesa's GLSL
    compiler takes most of a minute."""

    def literal(self, value: float) -> str:
        """A float32 as text that parses to the same number."""
        text = shortest(np.float32(value))
        if _LARGEST < abs(float(text)) < math.inf:  # its shortest text, which compilers refuse
            text = repr(math.copysign(_LARGEST, value))
        return text if any(c in text for c in ".en") else f"{text}.0"

    def datum(self, origin: Any) -> str:
        """Where a function finds a number that is data, in languages that support this."""
        raise NotImplementedError(origin)

    def type(self, count: int, kind: str = FLOAT) -> str:
        """The type of `count` values."""
        return self.vectors.format(count) if count > 1 else self.types[kind]

    def declaration(self, kind: str, name: str, value: str) -> str:
        """A statement that names a value; for the kind see :meth:`type`."""
        return f"{kind} {name} = {value};"

    def vector(self, parts: Sequence[str]) -> str:
        """A vector of numbers, or the number itself if it is one."""
        return f"{self.type(len(parts))}({', '.join(parts)})" if len(parts) > 1 else parts[0]

    def repeated(self, value: str, count: int) -> str:
        """A vector that repeats one number."""
        return f"{self.type(count)}({value})" if count > 1 else value

    def template(self, kind: str, name: str) -> str:
        """Format string of an operation of :mod:`nacre.compile.trace`.

        Raises NacreError if the language has no such operation.
        """
        key = f"{kind} {name}" if kind == INDEX else name
        if key not in self.operations:
            raise NacreError(
                f"holds numbers in tables: fit a network to it first (nacre fit){other(TABLES)}"
            )
        return self.operations[key]

    def sums(self, inputs: Sequence[str], weights: Weights, biases: Weights) -> str:
        """Sums of a layer as one vector, for inputs by name.

        Weights and biases have shapes (inputs, sums) and (sums,), with up to four sums.
        """
        rows = [f"{x} * {self.numbers(row)}" for x, row in zip(inputs, weights, strict=True)]
        return "\n        + ".join([self.numbers(biases), *rows])

    def numbers(self, values: Weights) -> str:
        return self.vector([self.literal(value) for value in values])

    def function(self, function: Function, name: str) -> str:
        """A function as text; all its results together have up to four numbers."""
        results = list(itertools.chain(*function.results.values()))
        body = Body(self, function, results)
        lines = [f"    {line}" for line in body.statements]
        value = self.vector([body.text(result) for result in results])
        parameters = ", ".join(
            self.parameter(self.type(count), each) for each, count in function.parameters.items()
        )
        head = self.head(self.type(len(results)), name, parameters)
        return "\n".join([f"{head} {{", *lines, f"    return {value};", "}"])

    def parameter(self, kind: str, name: str) -> str:
        return f"{kind} {name}"

    def head(self, kind: str, name: str, parameters: str) -> str:
        return f"{kind} {name}({parameters})"

    def component(self, vector: str, index: int) -> str:
        return f"{vector}.{_AXES[index]}"

    def opening(self) -> Sequence[str]:
        """Lines before the functions."""
        return ()

    def comments(self, lines: Sequence[str]) -> list[str]:
        return [f"{self.comment}{line}".rstrip() for line in lines]


class Body:
    """The statements of a function."""

    def __init__(self, language: Language, function: Function, results: Sequence[int]) -> None:
        self.statements: list[str] = []
        self._language, self._function = language, function
        self._step = 4 if language.packed and language.vectors else 1
        self._operations = function.operations
        self._packs: dict[tuple[int, ...], bool] = {}
        self._texts: dict[Item, tuple[str, int]] = {}  # with how strongly it binds
        uses = self._uses(results)
        for item in sorted(uses, key=lambda item: item if isinstance(item, int) else max(item)):
            self._write(item, uses[item])

    def text(self, item: Item) -> str:
        """The text of a value where it is used."""
        return self._texts[item][0]

    def _uses(self, results: Sequence[int]) -> Counter[Item]:
        """How often each value and each vector is used."""
        uses: Counter[Item] = Counter()
        left: list[Item] = list(results)
        while left:
            item = left.pop()
            uses[item] += 1
            if uses[item] == 1:
                left.extend(self._sources(item))
        return uses

    def _sources(self, item: Item) -> Iterator[Item]:
        if isinstance(item, tuple):
            name = self._operations[item[0]][1]
            columns = zip(*(sources(self._operations[n]) for n in item), strict=True)
            for column in columns:
                yield column[0] if name == "output" or len(set(column)) == 1 else column
            return
        operation = self._operations[item]
        if operation[1] != "dense":
            yield from sources(operation)
            return
        for part in self._grouped(operation[5]):
            yield from (part, part)  # more than once, so that it has a name

    def _grouped(self, values: Sequence[int]) -> list[Item]:
        """Inputs of a layer, as vectors where possible."""
        found: list[Item] = []
        for start in range(0, len(values), 4):
            part = tuple(values[start : start + 4])
            found.extend([part] if self._packed(part) else part)
        return found

    def _packed(self, values: tuple[int, ...]) -> bool:
        """Whether values form one vector: adjacent sums of a layer, or computed from such."""
        if self._step == 1 or len(values) == 1:
            return False
        if values not in self._packs:
            self._packs[values] = self._isomorphic(values)
        return self._packs[values]

    def _isomorphic(self, values: tuple[int, ...]) -> bool:
        operations = [self._operations[value] for value in values]
        kind, name, *arguments = operations[0]
        if any(other[:2] != (kind, name) for other in operations):
            return False
        if name == "output":
            layer, row = arguments
            count = self._operations[layer][4]
            rows = [(layer, row + k) for k in range(len(values))]
            return (
                row % 4 == 0
                and len(values) == min(4, count - row)
                and [(other[2], other[3]) for other in operations] == rows
            )
        if name not in _UNIT_BY_UNIT:
            return False
        columns = zip(*(sources(other) for other in operations), strict=True)
        return all(len(set(column)) == 1 or self._packed(column) for column in columns)

    def _write(self, item: Item, uses: int) -> None:
        first = item if isinstance(item, int) else item[0]
        kind, name, *arguments = self._operations[first]
        if name == "dense":
            self._layer(first, *arguments)
            return
        short = self._short(item, name, arguments)
        if short is not None:
            self._texts[item] = short, _WEAKEST if short.startswith("-") else _STRONGEST
            return
        text, binding = self._composed(item, kind, name)
        if uses == 1 and len(text) < _LONGEST:
            self._texts[item] = text, binding
            return
        label = f"v{item}" if isinstance(item, int) else f"q{first}_{item[-1]}"
        of_type = self._language.type(1 if isinstance(item, int) else len(item), kind)
        self.statements.append(self._language.declaration(of_type, label, text))
        self._texts[item] = label, _STRONGEST

    def _short(self, item: Item, name: str, arguments: Sequence[int]) -> str | None:
        """Text of what needs no name: inputs, numbers, sums of layers."""
        if name == "output":
            layer, row = arguments
            return self._sum(layer, row) if isinstance(item, int) else f"s{layer}_{row // 4}"
        if not isinstance(item, int):
            return None
        if name == "input":
            return self._language.component(*self._function.parameter(arguments[0]))
        if name == "whole":
            return str(arguments[0])
        if name == "datum":
            return self._language.datum(self._function.origins[arguments[0]])
        constant = self._function.number(item)
        return None if constant is None else self._language.literal(constant)

    def _composed(self, item: Item, kind: str, name: str) -> tuple[str, int]:
        """Text of an operation, and how strongly it binds."""
        template = self._language.template(kind, name)
        call = template[0].isalpha()
        binding = _STRONGEST if call else _BINDING.get(name, _WEAKEST)
        required = _STRONGEST if name == "neg" else max(binding, 1)
        values = []
        for place, source in enumerate(self._sources(item)):
            text, own = self._texts[source]
            if isinstance(item, tuple) and isinstance(source, int):
                text, own = self._language.repeated(text, len(item)), _STRONGEST
            # With equal binding, the left operand is evaluated first.
            if not call and (own < required or (place and own == binding)):
                text = f"({text})"
            values.append(text)
        return template.format(*values), binding

    def _sum(self, layer: int, row: int) -> str:
        if self._step == 1:
            return f"s{layer}_{row}"
        name, count = f"s{layer}_{row // 4}", self._operations[layer][4]
        alone = row % 4 == 0 and row == count - 1
        return name if alone else self._language.component(name, row % 4)

    def _layer(
        self, number: int, weights: int, biases: int, rows: int, inputs: Sequence[int]
    ) -> None:
        language, step = self._language, self._step
        names: list[str] = []
        for part in self._grouped(inputs):
            text = self.text(part)
            if isinstance(part, int):
                names.append(text)
            else:
                names.extend(language.component(text, k) for k in range(len(part)))
        matrix = self._function.tables[weights].reshape(len(inputs), rows)
        constants = self._function.tables[biases]
        for index, start in enumerate(range(0, rows, step)):
            part_of = slice(start, start + step)
            value = language.sums(names, matrix[:, part_of], constants[part_of])
            kind = language.type(len(constants[part_of]))
            self.statements.append(language.declaration(kind, f"s{number}_{index}", value))


class SourceTarget(Target):
    """A target that writes one file with functions `NAME_eval`, `NAME_sample`, `NAME_pdf`."""

    language: ClassVar[Language]
    suffix: ClassVar[str]

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        return {f"{name}{self.suffix}": self.source(self.reflectance(material), name).encode()}

    def source(self, brdf: Brdf, name: str) -> str:
        head = [*self.language.comments(preamble(brdf)), *self.language.opening()]
        return "\n\n".join(["\n".join(head), *self.written(brdf, name).values()]) + "\n"

    def written(self, brdf: Brdf, name: str) -> dict[str, str]:
        """Each function as text, by the names of :func:`nacre.targets.program`.

        Raises NacreError if the language cannot hold the material; the message says what can.
        """
        functions = program(brdf, expanded=self.language.expanded)
        try:
            _check_weights(functions["eval"], self.language.max_weights)
            return {
                each: self.language.function(function, f"{name}_{each}")
                for each, function in functions.items()
            }
        except NacreError as error:
            raise NacreError(f"{brdf.name or 'this material'}: {error}") from None


def _check_weights(function: Function, most: float) -> None:
    """Raise a NacreError for layers that have more weights than `most`."""
    dense = (operation for operation in function.operations.values() if operation[1] == "dense")
    count = sum(function.tables[table].size for operation in dense for table in operation[2:4])
    if count > most:
        what = f"{count:,} weights are more than the {most:,} that compilers take as literals"
        raise NacreError(f"{what}: nacre fit --hidden 64,64 makes fewer{other(WIDE)}")
