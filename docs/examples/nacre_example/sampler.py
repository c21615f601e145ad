"""A sampler: a power of the cosine, whatever the view."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nacre import Sampler
from nacre.array import Array, Components, namespace


@dataclass(frozen=True)
class PowerCosine(Sampler):
    """Density (n + 1) / (2 pi) cos(theta_i)^n.

    A dataclass describes itself by its fields and is made of them again, so that a network's file
    can hold it; others override `describe` and `from_description`.

    Parameters
    ----------
    exponent
        n, at least 0.
    """

    kind = "power-cosine"

    exponent: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.exponent < math.inf:
            raise ValueError(f"exponent must be finite and at least 0, got {self.exponent}")

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """Directions `wi` from u[1] and u[2], and their densities."""
        xp = namespace(*wo, *u)
        z = xp.exp(xp.log(1.0 - u[1]) * (1.0 / (self.exponent + 1.0)))
        radius, phi = xp.sqrt(xp.maximum(1.0 - z * z, 0.0)), 2.0 * math.pi * u[2]
        wi = radius * xp.cos(phi), radius * xp.sin(phi), z
        return wi, self.pdf_components(wi, wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        """Density of `wi`, 0 below the horizon."""
        xp = namespace(*wi, *wo)
        power = xp.exp(self.exponent * xp.log(xp.maximum(wi[2], 1e-12)))
        density = (self.exponent + 1.0) / (2.0 * math.pi) * power
        return xp.where((wi[2] > 0.0) & (wo[2] > 0.0), density, 0.0 * density)
