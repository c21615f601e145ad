"""Comparing reflectances, in numbers and in pictures.

Names load on first use: importing this module brings neither Mitsuba nor an image library.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nacre.evaluate.compare import Comparison, LightComparison, compare
    from nacre.evaluate.metrics import (
        AngularErrors,
        ImageErrors,
        angular_errors,
        flip,
        image_errors,
    )
    from nacre.evaluate.picture import picture

_homes = {
    "AngularErrors": "metrics",
    "Comparison": "compare",
    "ImageErrors": "metrics",
    "LightComparison": "compare",
    "angular_errors": "metrics",
    "compare": "compare",
    "flip": "metrics",
    "image_errors": "metrics",
    "picture": "picture",
}

__all__ = [
    "AngularErrors",
    "Comparison",
    "ImageErrors",
    "LightComparison",
    "angular_errors",
    "compare",
    "flip",
    "image_errors",
    "picture",
]


def __getattr__(name: str) -> Any:
    if name not in _homes:
        raise AttributeError(f"module 'nacre.evaluate' has no attribute {name!r}")
    # Kept here, so that a submodule of the same name does not hide the function it holds.
    value = getattr(importlib.import_module(f"nacre.evaluate.{_homes[name]}"), name)
    globals()[name] = value
    return value
