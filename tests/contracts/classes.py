"""Classes of nacre that the tables of contracts have to have an object of."""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from typing import Any

import nacre

_SUBCLASS = re.compile(r"^class \w+\(.*(Brdf|Sampler)\):", re.MULTILINE)


def concrete(base: type) -> set[type[Any]]:
    """Every class of nacre below :class:`Brdf` or :class:`Sampler` that objects are made of."""
    root = Path(nacre.__path__[0])
    for path in root.rglob("*.py"):
        if _SUBCLASS.search(path.read_text(encoding="utf-8")):
            importlib.import_module(
                ".".join(("nacre", *path.relative_to(root).with_suffix("").parts))
            )
    found: set[type[Any]] = set()
    left = [base]
    while left:
        children = left.pop().__subclasses__()
        left += children
        found |= {c for c in children if c.__module__.startswith("nacre.")}
    return {c for c in found if not inspect.isabstract(c)}
