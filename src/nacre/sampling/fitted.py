"""Reflectances that bring no sampler of their own."""

from __future__ import annotations

from functools import cached_property

from nacre.brdf import Brdf, Sampler
from nacre.sampling.fit import fit_lobes


class LobeSampledBrdf(Brdf):
    """A reflectance that samples itself by lobes fitted to it when they are first asked for."""

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """The fitted lobes."""
        return fit_lobes(self)
