"""The Lambertian reflectance."""

from __future__ import annotations

from nacre.analytic.model import DIFFUSE, AnalyticBrdf, Values, lambertian
from nacre.array import Components
from nacre.brdf import CosineSampler, Sampler


class Lambert(AnalyticBrdf):
    """The same in all directions: `diffuse` is the albedo."""

    model = "lambert"
    parameters = (DIFFUSE,)
    sampler: Sampler = CosineSampler()

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        everywhere = 0.0 * (wi[2] + wo[2])
        red, green, blue = (f + everywhere for f in lambertian(values))
        return red, green, blue
