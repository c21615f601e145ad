"""Experiments and benchmarks run for minutes or hours: here they are imported only."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = [
    f"{folder}.{path.stem}"
    for folder in ("benchmarks", "experiments")
    for path in sorted((ROOT / folder).glob("[a-z]*.py"))
]


@pytest.mark.parametrize("name", MODULES)
def test_what_they_need_is_there(name):
    importlib.import_module(name)
