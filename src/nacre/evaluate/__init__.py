"""Comparing reflectances, in numbers and in pictures.

Names load on first use: importing this module brings neither Mitsuba nor an image library.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nacre.evaluate.comparison import Comparison, LightComparison, compare
    from nacre.evaluate.drawing import picture
    from nacre.evaluate.metrics import (
        AngularErrors,
        ImageErrors,
        angular_errors,
        flip,
        image_errors,
    )

_homes = {
    "AngularErrors": "metrics",
    "Comparison": "comparison",
    "ImageErrors": "metrics",
    "LightComparison": "comparison",
    "angular_errors": "metrics",
    "compare": "comparison",
    "flip": "metrics",
    "image_errors": "metrics",
    "picture": "drawing",
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
    return getattr(importlib.import_module(f"nacre.evaluate.{_homes[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
