"""The mutants of a module: every place where one of the operators applies, and the new text.

Left out, by rule, is what changes nothing that a test should know: docstrings, annotations,
imports, `__all__`, f-strings, whatever is within a `raise` or assigned right before it, texts of
warnings, names of type variables, `strict` of `zip`, `copy` of `astype`, and constants that bound
work or memory (:data:`_BOUND`).
"""

from __future__ import annotations

import ast
import copy
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_BOUND = re.compile(
    r"_?(\w+_)?(LIMIT|MEMORY|BLOCK|CHECKED|MAPPED|PAIRS|POINTS|TILE|CACHE_SIZE|ITERATIONS|STEPS"
    r"|ORDERS?|SIDE|VIEWS|PER_VIEW|PARALLEL|SLICE|CHUNK)"
)
"""Names of constants that bound work or memory."""
_TEXT_ONLY = {"warn", "TypeVar", "log", "error", "refuse"}
"""Functions whose arguments are words for people, or a name for type checkers."""

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.BitXor: ast.BitOr,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Parameters
    ----------
    file
        Relative to the root of the repository.
    operator
        "comparison", "arithmetic", "boolean", "condition", "constant", "text", "return",
        "statement", "raise".
    start, end
        Characters of the source that are replaced.
    new
        What stands there instead.
    first, last
        Lines of the statement, or of its head, whose tests are asked.
    """

    file: str
    operator: str
    start: int
    end: int
    new: str
    first: int
    last: int

    def applied(self, source: str) -> str:
        """The changed source."""
        return source[: self.start] + self.new + source[self.end :]


def mutants(file: str, root: Path) -> list[Mutant]:
    """All mutants of a module, in the order of the source."""
    source = (root / file).read_text()
    found = _Finder(file, source)
    found.visit(ast.parse(source))
    return sorted(found.mutants, key=lambda m: (m.start, m.end, m.operator, m.new))


class _Finder(ast.NodeVisitor):
    def __init__(self, file: str, source: str) -> None:
        self.mutants: list[Mutant] = []
        self._file, self._source = file, source
        self._lines = [0]
        for line in source.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line.encode()))
        self._bytes = source.encode()
        self._statement: tuple[int, int] = (1, 1)
        self._words: set[ast.AST] = set()  # statements before a `raise`, which prepare its text

    def _offset(self, line: int, column: int) -> int:
        return len(self._bytes[: self._lines[line - 1] + column].decode())

    def _add(self, operator: str, node: Any, new: str) -> None:
        start = self._offset(node.lineno, node.col_offset)
        end = self._offset(node.end_lineno, node.end_col_offset)
        # As many lines as before: functions below are the same code as those of the file.
        breaks = "\n" * (node.end_lineno - node.lineno)
        text = f"{new[:-1]}{breaks})" if new.startswith("(") else new + breaks
        self.mutants.append(Mutant(self._file, operator, start, end, text, *self._statement))

    def _replaced(self, operator: str, node: ast.expr, **fields: Any) -> None:
        changed = copy.copy(node)
        for name, value in fields.items():
            setattr(changed, name, value)
        self._add(operator, node, f"({ast.unparse(changed)})")

    def visit(self, node: ast.AST) -> None:
        for name in ("body", "orelse"):
            block = getattr(node, name, None)
            if isinstance(block, list) and block and isinstance(block[-1], ast.Raise):
                self._words.update(block)
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            if body and isinstance(body[0], ast.stmt):
                last = max(node.lineno, body[0].lineno - 1)
            else:
                last = node.end_lineno or node.lineno
            before, self._statement = self._statement, (node.lineno, last)
            super().visit(node)
            self._statement = before
        else:
            super().visit(node)

    # What is left out.

    def visit_Import(self, node: ast.Import) -> None: ...

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None: ...

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None: ...

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        for default in [*node.args.defaults, *node.args.kw_defaults]:
            if default is not None:
                self.visit(default)
        for statement in node.body:
            self.visit(statement)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for statement in node.body:
            self.visit(statement)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        alias = isinstance(node.annotation, ast.Name) and node.annotation.id == "TypeAlias"
        if node.value is not None and not alias and not _bound(node.target):
            self._assigned(node)
            self.visit(node.value)

    def visit_Assign(self, node: ast.Assign) -> None:
        if node not in self._words and not any(_bound(target) for target in node.targets):
            self._assigned(node)
            self.visit(node.value)
            for target in node.targets:
                self.visit(target)

    def visit_If(self, node: ast.If) -> None:
        if isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return
        self._condition(node.test)
        self.generic_visit(node)

    # The operators.

    def _assigned(self, node: ast.Assign | ast.AnnAssign) -> None:
        """An attribute or an element that is not set; a name that is not would be noticed."""
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if all(isinstance(target, ast.Subscript) for target in targets):
            self._add("statement", node, "pass")

    def _condition(self, test: ast.expr) -> None:
        if not isinstance(test, ast.Compare | ast.BoolOp | ast.UnaryOp):
            self._add("condition", test, f"(not {ast.unparse(test)})")

    def visit_While(self, node: ast.While) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):  # a docstring, or `...`
            return
        if isinstance(node.value, ast.Call):
            if _called(node.value) in _TEXT_ONLY - {"error", "refuse"}:
                return
            self._add("statement", node, "pass")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._add("statement", node, "pass")
        if type(node.op) in _ARITHMETIC:
            target = ast.unparse(node.target)
            operator = ast.unparse(ast.BinOp(node.target, _ARITHMETIC[type(node.op)](), node.value))
            self._add("arithmetic", node, f"{target} = {operator}")
        self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> None:
        self._add("raise", node, "pass")

    def visit_Return(self, node: ast.Return) -> None:
        empty = node.value is None or (
            isinstance(node.value, ast.Constant) and node.value.value is None
        )
        if not empty:
            self._add("return", node, "return None")
        self.generic_visit(node)

    def visit_Break(self, node: ast.Break) -> None:
        self._add("statement", node, "continue")

    def visit_Continue(self, node: ast.Continue) -> None:
        self._add("statement", node, "break")

    def visit_Compare(self, node: ast.Compare) -> None:
        for index, op in enumerate(node.ops):
            if type(op) in _COMPARISONS:
                ops = [*node.ops[:index], _COMPARISONS[type(op)](), *node.ops[index + 1 :]]
                self._replaced("comparison", node, ops=ops)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        self._replaced("boolean", node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And())
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not):
            self._add("boolean", node, f"({ast.unparse(node.operand)})")
        elif isinstance(node.op, ast.USub):
            self._add("arithmetic", node, f"(+{ast.unparse(node.operand)})")
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        texts = any(
            isinstance(side, ast.JoinedStr)
            or (isinstance(side, ast.Constant) and isinstance(side.value, str | bytes))
            for side in (node.left, node.right)
        )
        if type(node.op) in _ARITHMETIC and not texts:
            self._replaced("arithmetic", node, op=_ARITHMETIC[type(node.op)]())
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = _called(node)
        if name in _TEXT_ONLY or name.endswith(("Error", "Warning")):
            return
        self.visit(node.func)
        for argument in node.args:
            self.visit(argument)
        for keyword in node.keywords:
            if (name, keyword.arg) not in {("zip", "strict"), ("astype", "copy")}:
                self.visit(keyword.value)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self._add("constant", node, str(not value))
        elif isinstance(value, int | float):
            self._add("constant", node, repr(value + 1))
        elif isinstance(value, str):
            self._add("text", node, repr(f"XX{value}XX"))
        elif isinstance(value, bytes):
            self._add("text", node, repr(b"XX" + value + b"XX"))


def _called(node: ast.Call) -> str:
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return node.func.id if isinstance(node.func, ast.Name) else ""


def _bound(target: ast.expr) -> bool:
    if not isinstance(target, ast.Name):
        return False
    return target.id == "__all__" or bool(_BOUND.fullmatch(target.id))


def modules(paths: list[str], root: Path) -> Iterator[str]:
    """The Python files of files and folders, relative to the root, sorted."""
    for path in paths:
        place = root / path
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            yield file.relative_to(root).as_posix()
