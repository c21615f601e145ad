"""Imports by name, which a linter cannot see: strings, registries, lazy loading, the facade."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath

import nacre

_PLACE = re.compile(r"\w+(\.\w+)+(:\w+)?")


def order(project: Mapping[str, object]) -> list[list[str]]:
    """Layers of the contracts of a `pyproject.toml`, the highest first: rooms that stand beside
    one another by layer. Those of a contract with containers stand over the ones before it.
    """
    found: list[list[str]] = []
    for contract in project["tool"]["importlinter"]["contracts"]:  # type: ignore[index]
        if contract["type"] == "layers":
            layers = [
                [f"{container}.{room}".lstrip(".") for room in re.split(r"\s*[|:]\s*", layer)]
                for layer in contract["layers"]
                for container in contract.get("containers", [""])
            ]
            found = layers + found
    return found


def facade() -> dict[str, str]:
    """Modules of the names that nacre has of others: {"nacre.load": "nacre.formats"}."""
    return {
        f"nacre.{name}": f"nacre.{module}"
        for module, names in nacre._ATTRIBUTES.items()
        for name in names
    }


class Tree:
    """The modules of packages, and in which layer each is.

    Parameters
    ----------
    roots
        Folders of the packages.
    layers
        From `order`. What is in none, like a package's own `__init__`, stands over all.
    facade
        Modules of names that a package has of others: `{"nacre.load": "nacre.formats"}`.
    """

    def __init__(
        self,
        roots: Sequence[Path],
        layers: Sequence[Sequence[str]],
        facade: Mapping[str, str] | None = None,
    ) -> None:
        self._ranks = {room: rank for rank, rooms in enumerate(layers) for room in rooms}
        self._facade = facade or {}
        self.modules = {
            ".".join((root.name, *path.relative_to(root).with_suffix("").parts)).removesuffix(
                ".__init__"
            ): path
            for root in roots
            for path in sorted(root.rglob("*.py"))
        }

    def rank(self, module: str) -> int:
        """Number of a module's layer, the highest 0; -1 for what is in none."""
        parts = module.split(".")
        rooms = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
        return next((self._ranks[room] for room in rooms if room in self._ranks), -1)

    def upward(self) -> list[str]:
        """Imports by name that run up, as "module:line names module"."""
        return [
            f"{module}:{line} names {target}"
            for module, path in self.modules.items()
            for line, target in self._named(module, path)
            if self.rank(target) < self.rank(module)
        ]

    def imports(self, module: str) -> set[str]:
        """Modules that a module imports, whether it is written so or by name."""
        return {target for _, target in self._named(module, self.modules[module])}

    def _named(self, module: str, path: Path) -> Iterator[tuple[int, str]]:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        package = module if path.name == "__init__.py" else module.rpartition(".")[0]
        for node in ast.walk(tree):
            for text in _texts(node, module, package):
                target = self._module(text)
                if target and target != module:
                    yield node.lineno, target  # type: ignore[attr-defined]

    def _module(self, text: str) -> str | None:
        """The module that a dotted name is in; none for a package's own name or no name at all."""
        name = text.partition(":")[0]
        parts = name.split(".")
        for length in range(len(parts), 1, -1):
            start = ".".join(parts[:length])
            if start in self.modules or start in self._facade:
                return self._facade.get(start, start)
        return None


def reached(root: Path, changed: Iterable[str]) -> dict[str, int]:
    """Files that import what changed, and how many imports lead there; paths are within `root`."""
    roots = [*root.glob("src/*"), *root.glob("lab/src/*"), root / "tests", root / "lab"]
    tree = Tree([each for each in roots if each.is_dir()], [], facade())
    importers: dict[str, set[str]] = {}
    for module in tree.modules:
        for target in tree.imports(module):
            importers.setdefault(target, set()).add(module)
    paths = {name: path.relative_to(root).as_posix() for name, path in tree.modules.items()}
    found: dict[str, int] = {}
    step, nearest = 0, {name for file in changed for name in _modules(file, tree, paths)}
    while nearest:
        found |= {paths[name]: step for name in nearest}
        further = {name for each in nearest for name in importers.get(each, ())}
        step, nearest = step + 1, {name for name in further if paths[name] not in found}
    return found


def _modules(file: str, tree: Tree, paths: dict[str, str]) -> set[str]:
    """Modules that a file stands for: itself, else those beside or above it or that name it."""
    folder = PurePosixPath(file).parent
    for place in (file, *map(str, (folder, *folder.parents[:-1]))):
        if place != "." and (found := {n for n, p in paths.items() if place in (p, _folder(p))}):
            return found
    named = [file, *([str(folder)] if len(folder.parts) > 1 else [])]
    texts = {name: path.read_text("utf-8") for name, path in tree.modules.items()}
    return {name for name, text in texts.items() if any(each in text for each in named)}


def _folder(path: str) -> str:
    return str(PurePosixPath(path).parent)


def _texts(node: ast.AST, module: str, package: str) -> Iterator[str]:
    """Dotted names that a node may stand for."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        if _PLACE.fullmatch(node.value):
            yield node.value
    elif isinstance(node, ast.JoinedStr):
        yield _joined(node, module, package)
    elif isinstance(node, ast.Attribute):
        yield ast.unparse(node)
    elif isinstance(node, ast.Import):
        yield from (each.name for each in node.names)
    elif isinstance(node, ast.ImportFrom) and not node.level:
        yield from (f"{node.module}.{each.name}" for each in node.names)
    elif isinstance(node, ast.Call):
        name = ast.unparse(node.func).rpartition(".")[2]
        texts = [_text(each, module, package) for each in node.args]
        if name == "import_module" and texts and texts[0].startswith("."):
            above = len(texts[0]) - len(texts[0].lstrip("."))
            start = (texts[1] if len(texts) > 1 else package).split(".")
            yield ".".join([*start[: len(start) - above + 1], texts[0].lstrip(".")])
        elif name == "attach" and texts:
            inner = [*node.args[1:], *(each.value for each in node.keywords)]
            for each in inner:
                keys = each.keys if isinstance(each, ast.Dict) else getattr(each, "elts", [])
                yield from (f"{texts[0]}.{_text(key, module, package)}" for key in keys)


def _text(node: ast.AST | None, module: str, package: str) -> str:
    """A string, or a name that stands for one; empty for all else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return _joined(node, module, package)
    named = {"__name__": module, "__package__": package}
    return named.get(node.id, "") if isinstance(node, ast.Name) else ""


def _joined(node: ast.JoinedStr, module: str, package: str) -> str:
    parts = (each.value if isinstance(each, ast.FormattedValue) else each for each in node.values)
    return "".join(_text(part, module, package) or "?" for part in parts)
