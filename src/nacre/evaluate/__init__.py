"""Comparing reflectances, in numbers and in pictures.

Names load on first use: importing this module brings neither Mitsuba nor an image library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

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

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "comparison": ["Comparison", "LightComparison", "compare"],
        "drawing": ["picture"],
        "metrics": ["AngularErrors", "ImageErrors", "angular_errors", "flip", "image_errors"],
    },
)
