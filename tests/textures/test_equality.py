"""Dataclasses that hold arrays: `==` of two of them must not ask for the truth of an array."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import nacre.textures

_ARRAYS = re.compile(r"\b(NDArray|ArrayLike|Floats|Angles|Indices|Tensor|Decorrelation)\b")
_FILES = sorted(Path(nacre.textures.__file__).parent.rglob("*.py"))


def _compared(source: str) -> list[str]:
    """Names of the dataclasses with a field of arrays that compare field by field."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.ClassDef):
            continue
        marks = [ast.unparse(mark) for mark in node.decorator_list]
        fields = [ast.unparse(f.annotation) for f in node.body if isinstance(f, ast.AnnAssign)]
        equal = any(m.startswith("dataclass") and "eq=False" not in m for m in marks)
        if equal and any(_ARRAYS.search(f) for f in fields):
            found.append(node.name)
    return found


def test_dataclasses_with_arrays_are_equal_only_to_themselves() -> None:
    found = {str(path): _compared(path.read_text("utf-8")) for path in _FILES}
    assert {name: classes for name, classes in found.items() if classes} == {}


def test_the_check_can_fail() -> None:
    assert _compared("@dataclass(frozen=True)\nclass A:\n    w: npt.NDArray[Any]\n") == ["A"]
    assert _compared("@dataclass(frozen=True, eq=False)\nclass A:\n    w: Floats\n") == []
