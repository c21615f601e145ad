"""Judging reflectances, by physics and against one another, in numbers and in pictures.

Names load on first use: importing this module brings neither Mitsuba nor an image library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.metrics.comparison import Comparison, LightComparison, compare
    from nacre.metrics.facts import physical_facts
    from nacre.metrics.metrics import (
        AngularErrors,
        ImageErrors,
        angular_errors,
        delta_itp,
        flip,
        image_errors,
        similarity_map,
    )
    from nacre.metrics.noise import sampling_variance
    from nacre.metrics.physics import (
        Estimate,
        albedo,
        anisotropy,
        known_fraction,
        reciprocity_error,
    )

__all__ = [
    "AngularErrors",
    "Comparison",
    "Estimate",
    "ImageErrors",
    "LightComparison",
    "albedo",
    "angular_errors",
    "anisotropy",
    "compare",
    "delta_itp",
    "flip",
    "image_errors",
    "known_fraction",
    "physical_facts",
    "reciprocity_error",
    "sampling_variance",
    "similarity_map",
]

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "comparison": ["Comparison", "LightComparison", "compare"],
        "facts": ["physical_facts"],
        "metrics": [
            "AngularErrors",
            "ImageErrors",
            "angular_errors",
            "delta_itp",
            "flip",
            "image_errors",
            "similarity_map",
        ],
        "noise": ["sampling_variance"],
        "physics": ["Estimate", "albedo", "anisotropy", "known_fraction", "reciprocity_error"],
    },
)
