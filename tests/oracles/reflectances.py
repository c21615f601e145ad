"""Made reflectances: Lambert under microfacets, isotropic or not, in the frame or off it."""

from __future__ import annotations

import math
from typing import Any

from nacre.array import Components, namespace
from nacre.brdf import Brdf
from nacre.geometry import dot, half_vector


class Glossy(Brdf):
    """Lambert and a GGX lobe (Walter et al. 2007) with the Smith term of uncorrelated heights."""

    def __init__(self, diffuse: float, specular: float, rough: float, across: float = 0.0) -> None:
        self.diffuse, self.specular = diffuse, specular
        self.rough = rough, across or rough
        self.isotropic = across in (0.0, rough)

    def distribution(self, m: Any) -> Any:
        a, b = self.rough
        length = (m[0] / a) ** 2 + (m[1] / b) ** 2 + m[2] * m[2]
        return 1.0 / (math.pi * a * b * length * length)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        h = half_vector(wi, wo)

        def seen(w: Components) -> Any:  # G1 / cos
            slope = (self.rough[0] * w[0]) ** 2 + (self.rough[1] * w[1]) ** 2
            return 2.0 / (w[2] + xp.sqrt(slope + w[2] * w[2]))

        fresnel = self.specular + (1.0 - self.specular) * (1.0 - dot(wi, h)) ** 5
        lobe = self.distribution(h) * seen(wi) * seen(wo) / 4.0 if self.specular else 0.0
        f = self.diffuse / math.pi + fresnel * lobe
        return f, 0.5 * f, 0.1 * f + 0.0 * wi[2]


class Beckmann(Glossy):
    """The same with Beckmann's distribution, off whose highlight a metal is all but black."""

    def distribution(self, m: Any) -> Any:
        xp = namespace(*m)
        a, b = self.rough
        steep = xp.maximum(m[2] * m[2], 1e-6)
        slope = ((m[0] / a) ** 2 + (m[1] / b) ** 2) / steep
        return xp.exp(-slope) / (math.pi * a * b * steep * steep)


class Rotated(Glossy):
    """A lobe whose axes lie 30 degrees off x and y, so that mirroring changes it."""

    def distribution(self, m: Any) -> Any:
        c, s = 0.75**0.5, 0.5
        return super().distribution((c * m[0] + s * m[1], c * m[1] - s * m[0], m[2]))
