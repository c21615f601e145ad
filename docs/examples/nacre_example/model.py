"""An analytic model: Minnaert 1941, "The Reciprocity Principle in Lunar Photometry"."""

from __future__ import annotations

import math

from nacre.analytic import AnalyticBrdf, Parameter
from nacre.array import Components, namespace


class Minnaert(AnalyticBrdf):
    """diffuse (k + 1) / (2 pi) (cos theta_i cos theta_o)^(k - 1): darker at the rim for k above 1,
    Lambertian for k = 1.
    """

    model = "minnaert"
    parameters = (
        Parameter("diffuse", 0.0, 1.0, (0.05, 0.8), color=True),
        Parameter("k", 0.0, 4.0, (0.5, 2.0)),
    )

    @staticmethod
    def formula(values, wi: Components, wo: Components) -> Components:
        """f_r in 1/sr: on numbers for a material, on arrays while it is fitted or rendered."""
        xp = namespace(*wi, *wo)
        k, cosines = values["k"], xp.maximum(wi[2] * wo[2], 1e-6)
        rim = (k + 1.0) / (2.0 * math.pi) * xp.exp((k - 1.0) * xp.log(cosines))
        red, green, blue = (albedo * rim for albedo in values["diffuse"])
        return red, green, blue
