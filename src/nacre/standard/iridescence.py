"""Reflectance of a thin film on a base, as in glTF's extension.

KHR_materials_iridescence (section "Iridescence Fresnel") simplifies Belcour and Barla 2017 ("A
Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", section 4): no
polarization, Schlick's approximation at both interfaces, a base without absorption, two orders of
interference. Reflection off a denser medium shifts the phase by half a wave and off a thinner
medium does not, so every shift is a sign.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.analytic.fresnel import schlick
from nacre.array import Array, Components, namespace
from nacre.color import xyz_to_rgb
from nacre.standard.parameter_math import of_numbers
from nacre.standard.thin_film import fringes, refracted

_TO_RGB = xyz_to_rgb(np.eye(3)).T.tolist()
_MAX_BASE = 0.9999  # reflectance of a base whose refractive index is finite


@dataclass(frozen=True)
class Film:
    """A thin film in air, seen from one side.

    Parameters
    ----------
    index
        Its refractive index, at least 1.
    outer
        Reflectance of its outer side.
    inner_cosine
        Between the normal and the refracted direction.
    waves
        Sensitivities X, Y and Z to path differences, for light that crosses the film once and twice
        more.
    """

    index: Array
    outer: Array
    inner_cosine: Array
    waves: tuple[Components, Components]

    @classmethod
    def seen(cls, index: Array, thickness: Array, cosine: Array) -> Film:
        """A film with a thickness in nm, seen at an angle from the normal given by its cosine."""
        inner = refracted(cosine, index)
        normal = ((index - 1.0) / (index + 1.0)) ** 2
        outer = schlick(cosine, (normal, normal, normal))[0]
        return cls(index, outer, inner, fringes(2e-3 * index * thickness * inner))

    def reflectance(self, base: tuple[Array, Array, Array]) -> Components:
        """Reflectance on a base, given the base's reflectance in air at normal incidence."""
        xp = namespace(self.outer)
        roots = [
            of_numbers("sqrt", of_numbers("minimum", of_numbers("maximum", f, 1e-8), _MAX_BASE))
            for f in base
        ]
        indices = [(1.0 + root) / (1.0 - root) for root in roots]
        contrasts = [(n - self.index) / (n + self.index) for n in indices]
        inner = schlick(self.inner_cosine, tuple(c * c for c in contrasts))
        signs = [c / of_numbers("sqrt", c * c + 1e-12) for c in contrasts]
        once, twice = self.waves
        # Each of X, Y and Z takes the sign of one channel, as in the extension's text.
        first = _to_rgb(tuple(-1.0 * s * w for s, w in zip(signs, once, strict=True)))
        second = _to_rgb(twice)
        passed = 1.0 - self.outer
        found = []
        for back, one, two in zip(inner, first, second, strict=True):
            both = xp.minimum(xp.maximum(self.outer * back, 1e-5), 0.9999)
            amplitude = xp.sqrt(both)
            steady = passed * passed * back / (1.0 - both)
            order = (steady - passed) * amplitude
            total = self.outer + steady + 2.0 * order * (one + amplitude * two)
            found.append(xp.maximum(total, 0.0))
        red, green, blue = found
        return red, green, blue


def _to_rgb(xyz: Components) -> Components:
    red, green, blue = (r * xyz[0] + g * xyz[1] + b * xyz[2] for r, g, b in _TO_RGB)
    return red, green, blue
