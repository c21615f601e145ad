"""What checking one property of a material gives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from nacre.array import Floats

State: TypeAlias = Literal["passed", "failed", "by design", "not applicable"]


class NotApplicableError(Exception):
    """A property that cannot be checked on a material; the message says why."""


@dataclass(frozen=True)
class Outcome:
    """What a property measures.

    Parameters
    ----------
    size
        How large the violation is.
    limit
        The largest `size` that passes.
    sentence
        What was found, in words that hold whether it passes or not.
    wi, wo
        Directions that were looked at, shape (n, 3).
    violation
        How much the property is violated at each, shape (n,), for the picture; not finite where
        f_r is not.
    """

    size: float
    limit: float
    sentence: str
    wi: Floats
    wo: Floats
    violation: Floats

    def worst(self) -> Place | None:
        """Where the violation is largest; None where there is none at all."""
        if not len(self.violation):
            return None
        ranked = np.where(np.isfinite(self.violation), self.violation, math.inf)
        index = int(ranked.argmax())
        return Place.of(self.wi[index], self.wo[index]) if ranked[index] > 0.0 else None


@dataclass(frozen=True)
class Place:
    """A pair of directions, in degrees: polar angles from the normal, and azimuths."""

    theta_i: float
    phi_i: float
    theta_o: float
    phi_o: float

    @classmethod
    def of(cls, wi: Floats, wo: Floats) -> Place:
        """From two directions, shape (3,)."""
        angles = []
        for x, y, z in (wi.tolist(), wo.tolist()):
            angles.append(math.degrees(math.atan2(math.hypot(x, y), z)))
            angles.append(math.degrees(math.atan2(y, x)))
        return cls(*(round(angle, 3) + 0.0 for angle in angles))

    def __str__(self) -> str:
        light, view = (
            f"{theta:.4g}" if theta < 1.0 else f"{theta:.4g}, {phi:.4g}"
            for theta, phi in ((self.theta_i, self.phi_i), (self.theta_o, self.phi_o))
        )
        return f"light {light}, view {view}"


@dataclass(frozen=True)
class Result:
    """One property of one material."""

    property: str  # its name in :data:`nacre.soundness.PROPERTIES`
    state: State
    sentence: str
    size: float | None = None
    """How large the violation is, in the unit that the property states; None where not applicable.
    """
    limit: float | None = None  # the largest size that passes
    where: Place | None = None
    outcome: Outcome | None = None  # all directions that were looked at, for pictures

    def facts(self) -> dict[str, Any]:
        """The result as JSON holds it: angles in degrees, numbers that are not finite as text."""
        where = None
        if self.where is not None:
            names = {"theta_i": "theta_i_deg", "phi_i": "phi_i_deg"}
            names |= {"theta_o": "theta_o_deg", "phi_o": "phi_o_deg"}
            where = {key: getattr(self.where, name) for name, key in names.items()}
        return {
            "property": self.property,
            "state": self.state,
            "size": _number(self.size),
            "limit": self.limit,
            "where": where,
            "sentence": self.sentence,
        }


def _number(value: float | None) -> float | str | None:
    return value if value is None or math.isfinite(value) else str(value)


@dataclass(frozen=True)
class Report:
    """All properties of one material."""

    name: str  # of the material
    results: Sequence[Result]

    @property
    def sound(self) -> bool:
        """Whether nothing failed; what is so by design does not count."""
        return not self.failures

    @property
    def failures(self) -> tuple[Result, ...]:
        """The results that failed."""
        return tuple(result for result in self.results if result.state == "failed")

    def __getitem__(self, name: str) -> Result:
        """The result of a property. Raises KeyError if it was not checked."""
        for result in self.results:
            if result.property == name:
                return result
        raise KeyError(name)

    def facts(self) -> Mapping[str, Any]:
        """The report as JSON holds it."""
        return {
            "material": self.name,
            "sound": self.sound,
            "properties": [result.facts() for result in self.results],
        }
