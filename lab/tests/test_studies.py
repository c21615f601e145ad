"""Studies run for minutes or hours: here they are imported only."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in sorted((ROOT / "lab" / "studies").rglob("[a-z]*.py"))
]


@pytest.mark.parametrize("name", MODULES)
def test_what_they_need_is_there(name):
    importlib.import_module(name)
