"""Judging reflectances, by physics and against one another, in numbers and in pictures.

Names load on first use: importing this module brings neither Mitsuba nor an image library.
"""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.metrics.comparison import Comparison as Comparison
    from nacre.metrics.comparison import LightComparison as LightComparison
    from nacre.metrics.comparison import compare as compare
    from nacre.metrics.facts import physical_facts as physical_facts
    from nacre.metrics.ldr_flip import flip as flip
    from nacre.metrics.metrics import AngularErrors as AngularErrors
    from nacre.metrics.metrics import ImageErrors as ImageErrors
    from nacre.metrics.metrics import angular_errors as angular_errors
    from nacre.metrics.metrics import delta_itp as delta_itp
    from nacre.metrics.metrics import image_errors as image_errors
    from nacre.metrics.noise import sampling_variance as sampling_variance
    from nacre.metrics.physics import Estimate as Estimate
    from nacre.metrics.physics import albedo as albedo
    from nacre.metrics.physics import anisotropy as anisotropy
    from nacre.metrics.physics import known_fraction as known_fraction
    from nacre.metrics.physics import reciprocity_error as reciprocity_error
    from nacre.metrics.verdict import Verdict as Verdict
    from nacre.metrics.verdict import verdict as verdict

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "comparison": ["Comparison", "LightComparison", "compare"],
        "facts": ["physical_facts"],
        "ldr_flip": ["flip"],
        "metrics": [
            *("AngularErrors", "ImageErrors", "angular_errors", "delta_itp", "image_errors"),
        ],
        "noise": ["sampling_variance"],
        "physics": ["Estimate", "albedo", "anisotropy", "known_fraction", "reciprocity_error"],
        "verdict": ["Verdict", "verdict"],
    },
)
