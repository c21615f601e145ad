"""The package's rooms: sizes, what stands at the top, and who asks for the class of a member."""

from __future__ import annotations

import ast
import statistics
import tomllib
from functools import cache
from pathlib import Path

import pytest

import nacre
from nacre.registry import Registry
from tests.layers import Tree, facade, order

PROJECT = Path(__file__).parents[1]
PACKAGE = Path(nacre.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))
TOP = {
    "__init__.py",
    "__main__.py",
    "array.py",
    "brdf.py",
    "btf.py",
    "color.py",
    "errors.py",
    "export.py",
    "formats.py",
    "geometry.py",
    "registry.py",
    "render.py",
    "signatures.py",
    "spectra.py",
}
"""Interfaces, registries, and what every room speaks in: directions, colors, arrays, errors."""


def families() -> dict[str, tuple[Registry, str]]:
    """Registries, and the room that may know the classes of the members."""
    from nacre.analytic import MODELS
    from nacre.latent import BASES
    from nacre.sampling import SAMPLERS
    from nacre.textures.codecs import CODECS

    return {
        "models": (MODELS, "analytic"),
        "samplers": (SAMPLERS, "sampling"),
        "bases": (BASES, "latent"),
        "codecs": (CODECS, "textures/codecs"),
    }


def test_no_module_is_loose():
    assert {path.name for path in PACKAGE.glob("*.py")} == TOP


def test_modules_are_of_a_size_to_be_read():
    lines = {path: path.read_text(encoding="utf-8").count("\n") for path in MODULES}
    longest = max(lines, key=lambda path: lines[path])
    assert lines[longest] <= 500, longest
    assert statistics.median(lines.values()) < 200


def test_no_import_by_name_runs_up_the_layers():
    """`lint-imports` holds imports that are written as such to the same order."""
    roots = [PACKAGE, PROJECT / "lab/src/nacre_lab"]
    with (PROJECT / "pyproject.toml").open("rb") as file:
        tree = Tree(roots, order(tomllib.load(file)), facade())
    assert tree.rank("nacre") < tree.rank("nacre.cli.fit") < tree.rank("nacre.errors")
    assert tree.rank("nacre_lab.reproduce") < tree.rank("nacre.cli")
    assert tree.upward() == []


UPWARD = {
    "a string": "TRAINER = 'made.high:train'",
    "a member of a registry": "MODELS = Registry('made.models', {'mine': 'made.high.inner:Mine'})",
    "import_module": "def f(): return importlib.import_module('made.high')",
    "import_module, relative": "importlib.import_module('.high', __package__)",
    "__import__": "__import__('made.high.inner')",
    "a name with another's in it": "importlib.import_module(f'{__package__}.high')",
    "an unknown module of a room": "importlib.import_module(f'made.high.{name}')",
    "lazy names": "lazy_loader.attach(__package__, submod_attrs={'high': ['f']})",
    "lazy modules": "lazy_loader.attach('made', {'high'})",
    "the facade's module": "import made\ndef f(): return made.high.f",
    "the facade's name": "import made\ndef f(): return made.fit",
    "from the facade": "from made import fit",
}
DOWNWARD = {
    "a string": "PLACE = 'made.floor:f'",
    "beside": "PLACE = 'made.side:f'",
    "itself": "importlib.import_module(f'{__name__}')",
    "words": "GROUP, HELP = 'made.models', 'see made.high'",
    "version": "import made\nVERSION = made.__version__",
    "another's": "importlib.import_module('numpy.high')",
}


@pytest.mark.parametrize(
    ("written", "runs_up"),
    [(text, True) for text in UPWARD.values()] + [(text, False) for text in DOWNWARD.values()],
    ids=[*UPWARD, *(f"not {name}" for name in DOWNWARD)],
)
def test_imports_by_name_are_found(tmp_path: Path, written: str, runs_up: bool):
    contract = {"type": "layers", "layers": ["made.high", "made.low | made.side", "made.floor"]}
    layers = order({"tool": {"importlinter": {"contracts": [contract]}}})
    assert layers == [["made.high"], ["made.low", "made.side"], ["made.floor"]]
    room = tmp_path / "made"
    (room / "high").mkdir(parents=True)
    for name in ("__init__", "high/__init__", "high/inner", "low", "side", "floor"):
        (room / f"{name}.py").touch()
    (room / "__init__.py").write_text("importlib.import_module(f'{__name__}.high')")
    (room / "low.py").write_text(written)
    found = Tree([room], layers, {"made.fit": "made.high"}).upward()
    assert bool(found) == runs_up, found
    assert all(each.startswith("made.low:") for each in found)


@cache
def calls() -> list[tuple[Path, int, frozenset[str]]]:
    """Where classes are asked for: module, line, and the names within the call."""
    return [
        (path, node.lineno, frozenset(n.id for n in ast.walk(node) if isinstance(n, ast.Name)))
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("isinstance", "type")
    ]


@pytest.mark.parametrize("family", ["models", "samplers", "bases", "codecs"])
def test_nobody_outside_a_family_asks_for_the_class_of_its_members(family: str):
    registry, room = families()[family]
    classes = {getattr(member, "__name__", "") for _, member in registry.members()} - {""}
    assert classes
    asked = [
        f"{path.relative_to(PACKAGE)}:{line} {name}"
        for path, line, names in calls()
        if PACKAGE / room not in path.parents
        for name in names & classes
    ]
    assert not asked
