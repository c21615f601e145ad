"""Mitsuba's chi-square test of a BSDF."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any


def chi_square(
    mi: Any,
    bsdf: Any,
    degrees: float,
    distort: Callable[[Any, Any], Any] = lambda pdf, wo: pdf,
    steps: int = 64,
) -> Any:
    """Chi-square test of a BSDF's `sample` against its `pdf`, changed by `distort(pdf, wo)`.

    Not Mitsuba's BSDFAdapter: it drops samples where the reflectance is 0, which a clamped network
    may be above the horizon. Below it there are no samples, whatever density Mitsuba's `measured`
    gives those it draws there.
    """
    import drjit as dr

    context = mi.BSDFContext()
    angle = math.radians(degrees)

    def seen(count: int) -> Any:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f(0.8 * math.sin(angle), 0.6 * math.sin(angle), math.cos(angle))
        return si

    def sample(u: Any) -> tuple[Any, Any]:
        drawn, _ = bsdf.sample(context, seen(dr.width(u)), u[0], mi.Point2f(u[1], u[2]))
        up = (drawn.pdf > 0) & (drawn.wo.z > 0)
        return drawn.wo, dr.select(up, mi.Float(1.0), 0.0)

    def density(wo: Any) -> Any:
        return distort(bsdf.pdf(context, seen(dr.width(wo)), wo), wo)

    # 64 steps along an edge of a cell resolve a lobe of exponent 50000 off the pole: a tenth of a
    # degree of azimuth.
    return mi.chi2.ChiSquareTest(
        mi.chi2.SphericalDomain(), sample, density, 3, sample_count=400_000, res=101, ires=steps
    )
