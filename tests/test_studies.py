"""Studies run for minutes or hours: here they are imported only."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
IN_BLENDER = {"addon_script", "cycles_script"}  # run by Blender's own Python
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in sorted((ROOT / "studies").rglob("[a-z]*.py"))
    if path.stem not in IN_BLENDER
]


@pytest.mark.parametrize("name", MODULES)
def test_what_they_need_is_there(name):
    importlib.import_module(name)
