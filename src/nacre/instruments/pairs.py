"""Pairs of directions with weights: what every instrument sums f_r over."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nacre.array import Doubles


class Pairs(NamedTuple):
    """n pairs of directions, the light at azimuth 0.

    The weighted sum of f_r over them is a signal; a weight below 0 takes away what is left out.
    """

    wi: Doubles  # to the light, shape (n, 3)
    wo: Doubles  # to the receptor, shape (n, 3)
    weights: Doubles  # shape (n,)

    @classmethod
    def between(
        cls,
        light: tuple[Doubles, Doubles],
        view: tuple[Doubles, Doubles],
    ) -> Pairs:
        """Each of some directions to the light with each of some to the receptor.

        Both are directions (n, 3) or one, (3,), and their solid angles, to which weights are
        proportional, with the cosines of both.
        """
        (wi, lit), (wo, seen) = (
            (np.atleast_2d(w), np.atleast_1d(solid) * np.atleast_2d(w)[:, 2])
            for w, solid in (light, view)
        )
        every = np.repeat(wi, len(wo), axis=0), np.tile(wo, (len(wi), 1))
        return cls(*every, np.outer(lit, seen).reshape(-1))

    @classmethod
    def joined(cls, parts: Sequence[Pairs]) -> Pairs:
        """All pairs of some sums, whose signals add up."""
        return cls(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    def scaled(self, factor: float) -> Pairs:
        """The pairs of a signal times a factor."""
        return self._replace(weights=factor * self.weights)
