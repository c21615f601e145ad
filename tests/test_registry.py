"""Registries: members by name, imported when they are asked for."""

from __future__ import annotations

import sys

import pytest

from nacre.errors import NacreError
from nacre.registry import Registry
from nacre.targets import TARGETS

BUILTIN = {"tables": "wave:open", "numbers": "fractions:Fraction"}


def registry(**settings) -> Registry:
    return Registry("nacre.none", "thing", BUILTIN, **settings)


def test_members_are_imported_when_they_are_asked_for(monkeypatch):
    monkeypatch.delitem(sys.modules, "wave", raising=False)
    made = registry()
    assert list(made) == ["tables", "numbers"]
    assert "wave" not in sys.modules
    assert callable(made["tables"])
    assert "wave" in sys.modules


def test_members_of_a_process_come_before_or_behind():
    for first, expected in (
        (True, ["tables", "numbers", "x"]),
        (False, ["x", "tables", "numbers"]),
    ):
        made = registry(builtin_first=first)
        made.register("x", 1)
        assert list(made) == expected
        assert made["x"] == 1
        with pytest.raises(NacreError, match="there is a thing 'x' already"):
            made.register("x", 2)


def test_what_is_no_member_is_refused():
    made = registry(base=int)
    made.register("one", 1)
    made.register("kind", bool)
    for other in ("text", str):
        with pytest.raises(NacreError, match=r"thing 'other' is not a builtins\.int"):
            made.register("other", other)


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(NacreError, match=r"'x' is no known thing; known: tables, numbers"):
        registry().find("x")
    with pytest.raises(KeyError):
        registry()["x"]


def test_export_targets_are_classes_of_targets():
    with pytest.raises(NacreError, match=r"export target 'x' is not a nacre\.targets\.target\.Tar"):
        TARGETS.register("x", int)
    with pytest.raises(NacreError, match="'basic' is no known export target"):
        TARGETS.find("basic")


def test_no_package_takes_a_name_that_nacre_registers_by_an_entry_point(tmp_path, monkeypatch):
    facts = tmp_path / "other-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Name: other\nVersion: 1\n")
    (facts / "entry_points.txt").write_text("[nacre.models]\nopenpbr = fractions:Fraction\n")
    for path in ([str(tmp_path), *sys.path], [*sys.path, str(tmp_path)]):
        with monkeypatch.context() as patched:
            patched.setattr(sys, "path", path)
            models = Registry("nacre.models", "model", {})
            assert models["openpbr"].__module__ == "nacre.standard.openpbr"
