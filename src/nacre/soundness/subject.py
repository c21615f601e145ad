"""What can be checked: anything that gives f_r, and perhaps samples, densities and derivatives."""

from __future__ import annotations

import abc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from nacre.array import Floats
from nacre.soundness.result import NotApplicableError

Evaluate: TypeAlias = Callable[[Floats, Floats], Floats]
"""From directions `wi` and `wo`, shape (n, 3), to f_r in 1/sr, shape (n, channels)."""


@dataclass(frozen=True)
class Drawn:
    """Directions that a sampler drew."""

    wi: Floats  # shape (n, 3)
    pdf: Floats  # densities in 1/sr over solid angle, shape (n,); 0 for what was not drawn
    weight: Floats | None = None
    """What a renderer multiplies the light by, f_r cos(theta_i) / pdf, shape (n, channels); None
    where the sampler does not give it."""


@dataclass(frozen=True)
class Slope:
    """A derivative of f_r, and what it is the derivative of.

    Parameters
    ----------
    name
        The variable, in words: "the direction to the light", "the parameter alpha.value".
    step
        For differences.
    value
        f_r summed over channels at pairs of directions, shape (n,), with the variable moved by a
        number.
    derivative
        Of `value` where it has not moved, shape (n,).
    """

    name: str
    step: float
    value: Callable[[Floats, Floats, float], Floats]
    derivative: Callable[[Floats, Floats], Floats]


class Subject(abc.ABC):
    """A material of any origin as the properties see it.

    Directions are unit vectors of shape (n, 3) in the local frame, `wi` to the light and `wo` to
    the viewer, as float64; both hemispheres of a pair may be asked for.
    """

    name: str = "material"
    """What to call it."""
    isotropic: bool = False
    """Whether it claims that f_r does not change when the surface turns about its normal."""
    by_design: Mapping[str, str] = {}
    """Names of properties that it need not have, with the reason."""

    @abc.abstractmethod
    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f_r in 1/sr without the cosine, shape (n, channels)."""

    def sample(self, wo: Floats, u: Floats) -> Drawn:
        """Directions to the light for `u` in [0, 1), shape (n, 3).

        Raises NotApplicableError if it has no sampler.
        """
        raise NotApplicableError("it has no sampler")

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        """Density in 1/sr with which :meth:`sample` draws `wi` for `wo`, shape (n,).

        Raises NotApplicableError if it is not known.
        """
        raise NotApplicableError("it has no density")

    def slopes(self) -> Sequence[Slope]:
        """Its derivatives. Raises NotApplicableError if it has none."""
        raise NotApplicableError("it has no derivatives")

    def variants(self) -> Mapping[str, Evaluate]:
        """Other ways to evaluate the same f_r, by name.

        Raises NotApplicableError if there are none.
        """
        raise NotApplicableError("there is one way to evaluate it")

    def tolerance(self, variant: str) -> float:
        """By how much f_r may differ in a variant, as a share of f_r."""
        return 0.01


def above(w: Floats) -> Floats:
    """Whether directions are above the horizon, shape (n,)."""
    return np.asarray(w[:, 2] > 0.0)
