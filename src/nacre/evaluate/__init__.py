"""Judging reflectances, by physics and against one another, in numbers and in pictures.

Names load on first use: importing this module brings neither Mitsuba nor an image library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.evaluate.comparison import Comparison, LightComparison, compare
    from nacre.evaluate.drawing import picture
    from nacre.evaluate.facts import physical_facts
    from nacre.evaluate.lobes import Lobe, lobe
    from nacre.evaluate.metrics import (
        AngularErrors,
        ImageErrors,
        angular_errors,
        flip,
        image_errors,
        similarity_map,
    )
    from nacre.evaluate.physics import (
        Estimate,
        albedo,
        anisotropy,
        known_share,
        reciprocity_error,
    )
    from nacre.evaluate.plot import lobe_figure, write_plot

__all__ = [
    "AngularErrors",
    "Comparison",
    "Estimate",
    "ImageErrors",
    "LightComparison",
    "Lobe",
    "albedo",
    "angular_errors",
    "anisotropy",
    "compare",
    "flip",
    "image_errors",
    "known_share",
    "lobe",
    "lobe_figure",
    "physical_facts",
    "picture",
    "reciprocity_error",
    "similarity_map",
    "write_plot",
]

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "comparison": ["Comparison", "LightComparison", "compare"],
        "drawing": ["picture"],
        "facts": ["physical_facts"],
        "lobes": ["Lobe", "lobe"],
        "metrics": [
            "AngularErrors",
            "ImageErrors",
            "angular_errors",
            "flip",
            "image_errors",
            "similarity_map",
        ],
        "physics": ["Estimate", "albedo", "anisotropy", "known_share", "reciprocity_error"],
        "plot": ["lobe_figure", "write_plot"],
    },
)
