"""An export target: JavaScript, for tools that evaluate a material without a GPU."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from nacre.targets.source import Language, SourceTarget

_MATH = "sqrt", "floor", "abs", "exp", "log", "sin", "cos"


class JavaScript(Language):
    """Numbers without types; vectors are arrays, on which there is no arithmetic."""

    vectors = ""
    operations: ClassVar = {
        **Language.operations,
        **{name: f"Math.{name}({{0}})" for name in _MATH},
        "min": "Math.min({0}, {1})",
        "max": "Math.max({0}, {1})",
        "arcsin": "Math.asin({0})",
        "arctan2": "Math.atan2({0}, {1})",
    }

    def declaration(self, kind: str, name: str, value: str) -> str:
        return f"const {name} = {value};"

    def vector(self, parts: Sequence[str]) -> str:
        return f"[{', '.join(parts)}]" if len(parts) > 1 else parts[0]

    def component(self, vector: str, index: int) -> str:
        return f"{vector}[{index}]"

    def parameter(self, kind: str, name: str) -> str:
        return name

    def head(self, kind: str, name: str, parameters: str) -> str:
        return f"export function {name}({parameters})"


class JavaScriptTarget(SourceTarget):
    """An ES module of functions on arrays of three numbers."""

    title = "JavaScript functions"
    language, suffix = JavaScript(), ".mjs"
