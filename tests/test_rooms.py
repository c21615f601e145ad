"""The package's rooms: sizes, what stands at the top, and who asks for the class of a member."""

from __future__ import annotations

import ast
import statistics
from pathlib import Path

import pytest

import nacre
from nacre.registry import Registry

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
    "formats.py",
    "geometry.py",
    "registry.py",
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


@pytest.mark.parametrize("family", ["models", "samplers", "bases", "codecs"])
def test_nobody_outside_a_family_asks_for_the_class_of_its_members(family: str):
    registry, room = families()[family]
    classes = {getattr(member, "__name__", "") for _, member in registry.members()} - {""}
    assert classes
    asked = [
        f"{path.relative_to(PACKAGE)}:{node.lineno} {name}"
        for path in MODULES
        if PACKAGE / room not in path.parents
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("isinstance", "type")
        for name in {n.id for n in ast.walk(node) if isinstance(n, ast.Name)} & classes
    ]
    assert not asked
