"""Lobes for importance sampling, predicted from a code by a shallow network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import Sampler
from nacre.numerics.mlp import TANH, Layer, forward, widths
from nacre.sampling.parametrizations import Parametrization, find_parametrization


@dataclass(frozen=True, eq=False)
class LobePredictor:
    """A network from a code to the free parameters of a kind of sampler.

    Hidden units are hyperbolic tangents, so that parameters stay bounded for a code far from those
    of the training; the family's functions then keep them valid.

    Raises ValueError if the family is not known, or the layers do not chain to its size.
    """

    family: str
    """Name of a :class:`nacre.sampling.parametrizations.Parametrization`."""
    layers: Sequence[Layer]

    def __post_init__(self) -> None:
        size = find_parametrization(self.family).size
        if widths(self.layers)[-1] != size:
            raise ValueError(f"{self.family} takes {size} parameters")

    @property
    def parametrization(self) -> Parametrization:
        return find_parametrization(self.family)

    def __call__(self, code: npt.ArrayLike) -> Sampler:
        """The sampler for a code of shape (k,)."""
        return self.parametrization.sampler(self.free(code))

    def free(self, code: npt.ArrayLike) -> Floats:
        """Its free parameters, as many as the family's size."""
        return np.asarray(forward(np.asarray(code, np.float32), self.layers, TANH))
