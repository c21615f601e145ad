"""Which properties reflectances need not have."""

from __future__ import annotations

from collections.abc import Mapping

from nacre.analytic import AnalyticBrdf
from nacre.brdf import Brdf
from nacre.numerics.albedo import USUAL_ALBEDO

STORED = {
    "reciprocity": "measurements, and networks and codes of them, need not be reciprocal",
    "energy": f"errors of measurements reach an albedo of {USUAL_ALBEDO}",
}
"""Of what is measured, or fitted to measurements."""


def excuses(reason: str, size: float) -> bool:
    """Whether a reason covers a violation of a size: errors of measurements have a usual one."""
    return reason != STORED["energy"] or size <= USUAL_ALBEDO


def by_design(brdf: Brdf) -> Mapping[str, str]:
    """Names of properties that a reflectance need not have, with the reason.

    They are those that its class declares (:attr:`nacre.Brdf.by_design`). What is measured, or
    fitted to measurements, need not be reciprocal nor conserve energy besides.
    """
    measured = brdf.nbytes is not None and not isinstance(brdf, AnalyticBrdf)
    return {**brdf.by_design, **(STORED if measured and not brdf.physical else {})}
