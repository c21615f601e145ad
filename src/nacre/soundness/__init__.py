"""Whether a BSDF is sound: properties that any reflectance can be checked for."""

from nacre.soundness.directions import Plan
from nacre.soundness.making import described, in_scene, subject
from nacre.soundness.result import NotApplicableError, Outcome, Place, Report, Result
from nacre.soundness.subject import Drawn, Slope, Subject
from nacre.soundness.table import PROPERTIES, check

__all__ = [
    "PROPERTIES",
    "Drawn",
    "NotApplicableError",
    "Outcome",
    "Place",
    "Plan",
    "Report",
    "Result",
    "Slope",
    "Subject",
    "check",
    "described",
    "in_scene",
    "subject",
]
