"""C: a header with functions for C99 and C++ that compilers vectorize.

Each function is written once, for `n` pairs of directions side by side: inlined with n = 1 it is
the function for one pair, and for a panel of pairs its loops become vector instructions. Conditions
select bits, because compilers do not vectorize branches.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar

from nacre.brdf import Brdf
from nacre.compile import elementary
from nacre.compile.trace import FLOAT, INDEX, MASK
from nacre.targets.program import Function
from nacre.targets.source import Body, Language, SourceTarget
from nacre.targets.stages import Straight, Sums, Units, stages
from nacre.targets.target import WIDE

_TILE = 12  # sums at a time: with their operands they fit into 16 registers

_PLAIN = {
    "exp": "expf", "log": "logf", "sin": "sinf", "cos": "cosf", "arcsin": "asinf",
    "arctan2": "atan2f",
}  # fmt: skip
"""C's names for elementary functions."""

_SUPPORT = "NACRE_C_1"
"""Guards the code that all materials share; the name must change when that does."""
_USE = (
    "",
    "Functions that end with _n take n pairs, with vectors stored one after another; -O3",
    "-march=native vectorizes them. There is no state: any thread may call any function.",
)
_INCLUDED = "math.h", "stddef.h", "stdint.h", "string.h"


class CLanguage(Language):
    """C99 that is also C++; a vector for `n` pairs holds all first components, then all second
    ones.
    """

    types: ClassVar = {FLOAT: "float", INDEX: "int32_t", MASK: "int"}
    vectors = ""
    max_weights = math.inf  # they are arrays
    operations: ClassVar = {
        "add": "{0} + {1}", "sub": "{0} - {1}", "mul": "{0} * {1}", "div": "{0} / {1}",
        "neg": "-{0}", "lt": "{0} < {1}", "le": "{0} <= {1}", "gt": "{0} > {1}", "ge": "{0} >= {1}",
        "eq": "{0} == {1}", "ne": "{0} != {1}", "and": "{0} & {1}", "or": "{0} | {1}",
        "not": "!{0}", "where": "nacre_pick({0}, {1}, {2})", "min": "nacre_min({0}, {1})",
        "max": "nacre_max({0}, {1})", "sqrt": "nacre_sqrt({0})", "abs": "fabsf({0})",
        "fma": "nacre_fma({0}, {1}, {2})", "to_float": "nacre_to_float({0})",
        "exp": "nacre_exp({0})", "log": "nacre_log({0})",
        "sin": "nacre_sin({0})", "cos": "nacre_cos({0})", "arcsin": "nacre_arcsin({0})",
        "arctan2": "nacre_arctan2({0}, {1})",
        "from_bits": "nacre_float({0})", "index bits": "nacre_bits({0})",
        "index add": "nacre_add({0}, {1})", "index sub": "nacre_sub({0}, {1})",
        "index and": "{0} & {1}", "index xor": "{0} ^ {1}",
        "index shl": "nacre_shl({0}, {1})", "index shr": "{0} >> {1}",
    }  # fmt: skip

    def literal(self, value: float) -> str:
        text = super().literal(value)
        return {"inf": "INFINITY", "-inf": "-INFINITY", "nan": "NAN"}.get(text, f"{text}f")

    def declaration(self, kind: str, name: str, value: str) -> str:
        return f"const {kind} {name} = {value};"

    def component(self, vector: str, index: int) -> str:
        return f"{vector}[{_place(index)}]"

    def opening(self) -> Sequence[str]:
        support = Path(__file__).with_name("support.h").read_text(encoding="utf-8")
        return [
            *self.comments(_USE),
            "",
            *(f"#include <{each}>" for each in _INCLUDED),
            "",
            f"#ifndef {_SUPPORT}",
            f"#define {_SUPPORT}",
            "",
            *support.splitlines(),
            *_elementary(),
            "",
            "#endif",
        ]

    def function(self, function: Function, name: str) -> str:
        arrays: dict[str, int] = {}
        lines: list[str] = []
        for stage in stages(function):
            if isinstance(stage, Sums):
                lines.extend(_sums(self, stage))
                arrays[stage.source] = len(stage.weights)
                arrays[stage.target] = math.prod(_tiles(len(stage.biases)))
            else:
                lines.extend(self._loop(stage))
        held = [f"float {array}[{count} * NACRE_PANEL];" for array, count in arrays.items()]
        given = [f"const float *{each}" for each in function.parameters]
        lanes = ", ".join(["size_t n", *given, *(f"float *{each}" for each in function.results)])
        return "\n".join(
            [
                f"NACRE_INLINE void {name}_lanes({lanes}) {{",
                *_indented([*held, *lines]),
                "}\n",
                *_single(function, name),
                "",
                *_batch(function, name),
            ]
        )

    def _loop(self, stage: Straight | Units) -> list[str]:
        """A stage as a loop over pairs, or over the numbers in an array."""
        count = f"{stage.count} * n" if isinstance(stage, Units) else "n"
        results = stage.function.results
        body = Body(self, stage.function, list(itertools.chain(*results.values())))
        stored = [
            f"{self.component(name, place)} = {body.text(value)};"
            for name, values in results.items()
            for place, value in enumerate(values)
        ]
        lines = _indented([*body.statements, *stored])
        return [f"for (size_t l = 0; l < {count}; l++) {{", *lines, "}"]


class _Scalars(CLanguage):
    """Functions on plain numbers."""

    def component(self, vector: str, index: int) -> str:
        return vector


def _elementary() -> list[str]:
    """Exponential, logarithm and circular functions from operations that compilers vectorize."""
    lines = []
    for name, plain in _PLAIN.items():
        parameters = ("y", "x") if name == "arctan2" else ("x",)
        function = Function.of(
            name,
            lambda *values, name=name: [getattr(elementary, name)(*(x for (x,) in values))],
            dict.fromkeys(parameters, 1),
            ["result"],
        )
        (result,) = function.results["result"]
        body = Body(_Scalars(), function, [result])
        given = ", ".join(f"float {each}" for each in parameters)
        lines += [
            "",
            f"NACRE_INLINE float nacre_{name}({given}) {{",
            "#ifdef __FAST_MATH__  // which lets compilers reorder sums, and vectorize this",
            f"    return {plain}({', '.join(parameters)});",
            "#else",
            *_indented([*body.statements, f"return {body.text(result)};"]),
            "#endif",
            "}",
        ]
    return lines


def _sums(language: Language, layer: Sums) -> list[str]:
    """A layer as loops over tiles of sums, which stay in registers."""
    inputs, rows = layer.weights.shape
    tiles, size = _tiles(rows)
    width = tiles * size
    padding = [0.0] * (width - rows)

    def row(values: Iterable[float]) -> str:
        return f"{{{', '.join(language.literal(x) for x in [*values, *padding])}}}"

    label = layer.target
    matrix = ",\n".join(f"    {row(weights)}" for weights in layer.weights)
    return [
        f"static const float {label}_biases[{width}] = {row(layer.biases)};",
        f"static const float {label}_weights[{inputs}][{width}] = {{",
        *matrix.splitlines(),
        "};",
        f"for (size_t r = 0; r < {width}; r += {size}) {{",
        f"    const float *b = {label}_biases + r, *w = {label}_weights[0] + r;",
        f"    float *sums = {label} + r * n;",
        "    for (size_t l = 0; l < n; l++) {",
        *(f"        float t{t} = b[{t}];" for t in range(size)),
        "        NACRE_UNROLLED",
        f"        for (size_t k = 0; k < {inputs}; k++) {{",
        f"            const float x = {layer.source}[k * n + l];",
        *(f"            t{t} = nacre_fma(w[{width} * k + {t}], x, t{t});" for t in range(size)),
        "        }",
        *(f"        sums[{_place(t)}] = t{t};" for t in range(size)),
        "    }",
        "}",
    ]


def _tiles(rows: int) -> tuple[int, int]:
    """The number of tiles for the sums of a layer, and their size; the last may be padded."""
    tiles = -(-rows // _TILE)
    return tiles, -(-rows // tiles)


def _single(function: Function, name: str) -> list[str]:
    """The function for one pair; it returns its result if that is a single number."""
    given = [f"const float {each}[{count}]" for each, count in function.parameters.items()]
    found = {each: len(values) for each, values in function.results.items()}
    names = [*function.parameters, *found]
    if list(found.values()) == [1]:
        (result,) = found
        names[-1] = f"&{result}"
        return [
            f"static inline float {name}({', '.join(given)}) {{",
            f"    float {result};",
            f"    {name}_lanes(1, {', '.join(names)});",
            f"    return {result};",
            "}",
        ]
    given += [f"float {each}[3]" if n == 3 else f"float *{each}" for each, n in found.items()]
    return [
        f"static inline void {name}({', '.join(given)}) {{",
        f"    {name}_lanes(1, {', '.join(names)});",
        "}",
    ]


def _batch(function: Function, name: str) -> list[str]:
    """The function for many pairs: panels, then the rest one by one."""
    results = {each: len(values) for each, values in function.results.items()}
    widths = {**function.parameters, **results}
    vectors = [each for each, width in widths.items() if width == 3]
    here = {each: f"{each} + {_scaled(width, 'i')}" for each, width in widths.items()}
    panels = [f"{each}_panel" if each in vectors else here[each] for each in widths]
    given = [f"const float *{each}" for each in function.parameters]
    head = ", ".join(["size_t n", *given, *(f"float *{each}" for each in results)])
    return [
        f"static inline void {name}_n({head}) {{",
        *(f"    float {each}_panel[3 * NACRE_PANEL];" for each in vectors),
        "    size_t i = 0;",
        "    for (; i + NACRE_PANEL <= n; i += NACRE_PANEL) {",
        *(f"        nacre_split({here[each]}, {each}_panel);" for each in function.parameters),
        f"        {name}_lanes(NACRE_PANEL, {', '.join(panels)});",
        *(
            f"        nacre_join({each}_panel, {here[each]});"
            for each in results
            if each in vectors
        ),
        "    }",
        "    for (; i < n; i++) {",
        f"        {name}_lanes(1, {', '.join(here.values())});",
        "    }",
        "}",
    ]


def _place(index: int) -> str:
    """Index of a component of pair `l`."""
    return f"{_scaled(index, 'n')} + l" if index else "l"


def _scaled(count: int, name: str) -> str:
    return name if count == 1 else f"{count} * {name}"


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"    {line}" for line in lines]


class C(SourceTarget):
    title = "C99 header of functions that compilers vectorize, also C++"
    holds = frozenset({WIDE})
    language, suffix = CLanguage(), ".h"

    def source(self, brdf: Brdf, name: str) -> str:
        guard = f"NACRE_{name.upper()}_H"
        return f"#ifndef {guard}\n#define {guard}\n\n{super().source(brdf, name)}\n#endif\n"
