"""A fingerprint of the code that decides a result, so that results of older code can be told.

From the functions, classes or modules that make a result, the names in their source are followed
through imports to every function, class and constant that they can reach. What is not reached does
not count, and neither do comments, docstrings, annotations of functions and layout. Nothing is
imported or run to find out.

What is found by a name only while the code runs is followed where a text names it as registries do,
"nacre.measured.rgl:FORMAT". An object that a caller passes must have its class among the roots.
"""

from __future__ import annotations

import ast
import hashlib
import re
import sys
import threading
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

_PLACE = re.compile(r"([a-z_]\w*(?:\.\w+)+):(\w+)")
"""Something in a module, as registries write it."""

_SILENT = {"ctx", "kind", "type_comment", "returns"}  # fields of the syntax tree without effect

_LOCK = threading.Lock()  # makes threads that ask for the same wait for one search

_Import: TypeAlias = ast.Import | ast.ImportFrom
_Named: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


class _Target(NamedTuple):
    """A name in a module; the module itself where None, and what importing it does where empty."""

    module: str
    name: str | None


def code_fingerprint(*roots: str, within: tuple[str, ...] = ()) -> str:
    """SHA-256, in hexadecimal, of the code that some roots can reach, the same in every version of
    Python.

    Names are followed within the packages of the roots and those of `within`, imported already;
    from others, what is imported counts by its name. A root is "package.module:name" for a
    function, class or constant, or "package.module" for all in it; the packages are imported.

    Raises ValueError if there is no source of such a module, or nothing of that name in it,
    SyntaxError if source is no Python.
    """
    with _LOCK:
        return _fingerprint(roots, within)


@cache
def _fingerprint(roots: tuple[str, ...], within: tuple[str, ...]) -> str:
    search = _Search({root.partition(":")[0].partition(".")[0] for root in roots} | {*within})
    for root in roots:
        module, _, name = root.partition(":")
        search.reach(_Target(module, name or None))
    total = hashlib.sha256()
    for line in sorted(search.found):
        total.update(line.encode(errors="surrogatepass") + b"\0")
    return total.hexdigest()


def code_text(path: Path) -> str:
    """What a module does, as text: without comments, docstrings, annotations and layout.

    Raises SyntaxError if it is no Python.
    """
    return _text(ast.parse(path.read_bytes()))


def place_of(definition: Any) -> str:
    """The root of :func:`code_fingerprint` that a function or class is; for one that was made
    within another, the outer one; for a partial function, that function; for any other object, its
    class.
    """
    while isinstance(definition, partial):
        definition = definition.func
    if not hasattr(definition, "__qualname__"):
        definition = type(definition)
    module, name = definition.__module__, definition.__qualname__.partition(".")[0]
    return f"{module}:{name}" if name.isidentifier() else module


class _Module:
    """The top-level statements of a module, by the names that they give a value or change.

    Those with other effects have an empty name.
    """

    def __init__(self, path: Path) -> None:
        self.is_package = path.name == "__init__.py"
        self.statements: dict[str, list[ast.stmt]] = {}
        self.lazy: dict[str, ast.stmt] = {}
        """Imports for type checkers, which tell what a package gives when it is asked for."""
        for statement in ast.parse(path.read_bytes()).body:
            self._sort(statement)

    def _sort(self, statement: ast.stmt) -> None:
        if isinstance(statement, ast.If) and _is_for_types(statement.test):
            for inner in statement.body:
                self.lazy.update(dict.fromkeys(_bound(inner), inner))
            for inner in statement.orelse:
                self._sort(inner)
        elif not _is_text(statement):
            for name in set(_bound(statement)) or {""}:
                self.statements.setdefault(name, []).append(statement)


class _Search:
    """What was reached, each statement as a line of text."""

    def __init__(self, packages: set[str]) -> None:
        self._packages = packages
        self._modules: dict[str, _Module | None] = {}
        self._seen: set[_Target] = set()
        self.found: set[str] = set()

    def reach(self, target: _Target) -> None:
        """Follow a target, and all that follows from it."""
        found = self._resolved(target.module, target.name) if target.name else target
        module = self._module(found.module)
        if module is None or (found.name and found.name not in module.statements):
            raise ValueError(f"no source is found of {':'.join(filter(None, target))}")
        waiting = [found]
        while waiting:
            target = waiting.pop()
            if target not in self._seen and self._module(target.module):
                self._seen.add(target)
                waiting.extend(self._follow(target))

    def _follow(self, target: _Target) -> Iterator[_Target]:
        """Count what has a name, and yield what it refers to."""
        origin, name = target
        module = self._module(origin)
        assert module is not None
        yield _Target(origin, "")
        if parent := origin.rpartition(".")[0]:
            yield _Target(parent, "")
        if name is None:
            yield from (_Target(origin, each) for each in module.statements)
            return
        for statement in module.statements.get(name, []):
            if isinstance(statement, _Import):
                found = self._imported(origin, statement)[name]
                self.found.add(f"{origin}:{name} is {found.module}:{found.name}")
                if found.name is not None:  # from modules, only what is taken counts
                    yield found
            else:
                self.found.add(f"{origin}:{name} {_text(statement)}")
                yield from self._references(origin, statement)

    def _references(self, origin: str, statement: ast.stmt) -> Iterator[_Target]:
        """What a statement in a module names."""
        module = self._module(origin)
        assert module is not None
        nodes = list(_walk(statement))
        local: dict[str, _Target] = {}
        for node in nodes:
            if isinstance(node, _Import):
                local |= self._imported(origin, node)
        yield from (found for found in local.values() if found.name is not None)
        inner = {id(node.value) for node in nodes if isinstance(node, ast.Attribute)}
        for node in nodes:
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                if place := _PLACE.fullmatch(node.value):
                    yield _Target(place[1], place[2])
            elif isinstance(node, ast.Name | ast.Attribute) and id(node) not in inner:
                first, *rest = _dotted(node)
                if first in module.statements and first not in local:
                    yield _Target(origin, first)
                found = local.get(first) or self._global(origin, module, first)
                for part in rest:
                    if found and found.name is None and self._module(found.module):
                        found = self._resolved(found.module, part)
                if found and found.module != origin:
                    yield found

    def _global(self, origin: str, module: _Module, name: str) -> _Target | None:
        """What a name stands for that a module imports."""
        for statement in module.statements.get(name, []):
            if isinstance(statement, _Import):
                return self._imported(origin, statement)[name]
        return None

    def _imported(self, origin: str, statement: _Import) -> dict[str, _Target]:
        """What the names that a statement binds stand for."""
        if isinstance(statement, ast.Import):
            return {
                bound: _Target(alias.name if alias.asname else bound, None)
                for alias, bound in zip(statement.names, _bound(statement), strict=True)
            }
        source = statement.module or ""
        if statement.level:
            module = self._module(origin)
            assert module is not None
            parts = origin.split(".")
            kept = parts[: len(parts) - statement.level + module.is_package]
            source = ".".join([*kept, *filter(None, [statement.module])])
        return {a.asname or a.name: self._resolved(source, a.name) for a in statement.names}

    def _resolved(self, source: str, name: str) -> _Target:
        """What `from source import name` gives."""
        module = self._module(source)
        if module and name not in module.statements:
            statement = module.lazy.get(name)
            if isinstance(statement, ast.ImportFrom) and statement.module != source:
                return self._imported(source, statement)[name]
            if self._module(f"{source}.{name}"):
                return _Target(f"{source}.{name}", None)
        return _Target(source, name)

    def _module(self, name: str) -> _Module | None:
        """A module of the packages that are followed; None for any other, or without source."""
        if name.partition(".")[0] not in self._packages:
            return None
        if name not in self._modules:
            self._modules[name] = _parsed(name)
        return self._modules[name]


def _parsed(name: str) -> _Module | None:
    top, *rest = name.split(".")
    package = sys.modules.get(top)
    start = Path(getattr(package, "__file__", None) or "")
    if not rest:
        return _Module(start) if start.suffix == ".py" else None
    # A package without __init__.py may be in parts.
    folders = [start.parent] if start.name == "__init__.py" else getattr(package, "__path__", [])
    for folder in folders:
        place = Path(folder).joinpath(*rest)
        for path in (place / "__init__.py", place.with_name(f"{rest[-1]}.py")):
            if path.is_file():
                return _Module(path)
    return None


def _bound(statement: ast.stmt) -> Iterator[str]:
    """Names that a top-level statement gives a value or changes."""
    if isinstance(statement, _Import):
        imported = isinstance(statement, ast.Import)
        for alias in statement.names:
            yield alias.asname or (alias.name.partition(".")[0] if imported else alias.name)
    elif isinstance(statement, _Named):
        yield statement.name
    elif isinstance(statement, ast.Assign | ast.AugAssign | ast.AnnAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        for node in (node for target in targets for node in ast.walk(target)):
            if isinstance(node, ast.Name):
                yield node.id
            elif isinstance(node, ast.Subscript | ast.Attribute):
                yield ""  # it may change what another module has, as an entry in a registry does
    else:
        for inner in ast.iter_child_nodes(statement):
            if isinstance(inner, ast.stmt):
                yield from _bound(inner)


def _dotted(node: ast.expr) -> list[str]:
    """The names in `a.b.c`; an empty one first if it does not begin with a name."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return [node.id if isinstance(node, ast.Name) else "", *reversed(parts)]


def _is_for_types(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def _is_text(node: Any) -> bool:
    value = node.value if isinstance(node, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def _fields(node: ast.AST) -> Iterator[tuple[str, list[Any]]]:
    """The fields of a node that have an effect, as lists."""
    for field, value in ast.iter_fields(node):
        if field in _SILENT or (isinstance(node, ast.arg) and field == "annotation"):
            continue
        items = value if isinstance(value, list) else [value]
        if isinstance(node, ast.JoinedStr):  # some versions of Python end these in an empty text
            items = [item for item in items if getattr(item, "value", None) != ""]
        if items := [item for item in items if not (item is None or _is_text(item))]:
            yield field, items


def _walk(node: ast.AST) -> Iterator[ast.AST]:
    """A node and all below it that has an effect; annotations of values name types only."""
    waiting = [node]
    while waiting:
        node = waiting.pop()
        yield node
        for field, items in _fields(node):
            if field != "annotation":
                waiting.extend(item for item in items if isinstance(item, ast.AST))


def _text(node: Any) -> str:
    """A node as text that is the same in every version of Python."""
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = (f"{field}={','.join(map(_text, items))}" for field, items in _fields(node))
    return f"{type(node).__name__}({';'.join(fields)})"
