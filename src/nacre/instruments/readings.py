"""Readings: what instruments say of a surface."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.instruments.goniocolorimeter import E2194, E2539
from nacre.instruments.quantities import (
    FortyFiveQuantity,
    GlossQuantity,
    HazeQuantity,
    MultiangleQuantity,
    Quantity,
    SphereQuantity,
)

INSTRUMENTS = "gloss", "haze", "E2194", "E2539", "sphere", "45-0"
"""Names of instruments whose readings can be proposed; multi-angle ones have that of the standard
for their angles."""
COMMON = "gloss", "haze", "E2194", "sphere", "45-0"
"""Those that many shops have."""


@dataclass(frozen=True)
class Reading:
    """A value, or the values of a color, that an instrument read.

    Parameters
    ----------
    quantity
        What was read.
    values
        On the scale of the instrument, one for each of the quantity's components.
    uncertainty
        Standard deviation of each of them, above 0.

    Raises ValueError if there are too many or too few values, one is not finite, or the uncertainty
    is not above 0.
    """

    quantity: Quantity
    values: tuple[float, ...]
    uncertainty: float

    def __post_init__(self) -> None:
        if len(self.values) != len(self.quantity.components):
            expected = ", ".join(self.quantity.components)
            raise ValueError(f"{self.quantity.name} has the values {expected}")
        if not all(map(math.isfinite, self.values)):
            raise ValueError(f"{self.quantity.name}: a value is not finite")
        if not 0.0 < self.uncertainty < math.inf:
            raise ValueError(f"{self.quantity.name}: the uncertainty must be above 0")

    @classmethod
    def of(
        cls, brdf: Brdf, quantity: Quantity, uncertainty: float | None = None, azimuth: float = 0.0
    ) -> Reading:
        """What an instrument reads of a material, without noise."""
        values = quantity.read(brdf, azimuth)
        return cls(quantity, values, uncertainty or quantity.uncertainty(values))

    @property
    def seen(self) -> Doubles:
        """What the instrument saw, (c,); see :class:`Quantity`."""
        return self.quantity.turned_back(self.values)

    @property
    def noise(self) -> Doubles:
        """Standard deviations of what it saw, (c,)."""
        values = np.asarray(self.values)
        shifted = values + self.uncertainty * np.eye(len(values))
        changes = self.quantity.turned_back(shifted) - self.quantity.turned_back(values)
        return np.asarray(np.sqrt(np.square(changes).sum(axis=0)))


def combined(readings: Iterable[Reading]) -> list[Reading]:
    """Readings with the mean in place of those that repeat one.

    The uncertainty stays: an instrument that is wrong is wrong each time.
    """
    groups: dict[Quantity, list[Reading]] = {}
    for reading in readings:
        groups.setdefault(reading.quantity, []).append(reading)
    found = []
    for group in groups.values():
        values = np.mean([reading.values for reading in group], axis=0).tolist()
        uncertainty = float(np.mean([reading.uncertainty for reading in group]))
        found.append(replace(group[0], values=tuple(values), uncertainty=uncertainty))
    return found


def known_quantities(instruments: Iterable[str] = INSTRUMENTS) -> list[Quantity]:
    """All that given instruments read of an isotropic material, in the order of `INSTRUMENTS`."""
    of_each: dict[str, list[Quantity]] = {
        "gloss": [GlossQuantity(angle) for angle in (20.0, 60.0, 85.0)],
        "haze": [HazeQuantity()],
        "E2194": [MultiangleQuantity(at) for at in E2194],
        "E2539": [
            MultiangleQuantity(at)
            for at in E2539
            if at.azimuth is None or at.azimuth > 0.0  # the other side looks the same
        ],
        "sphere": [SphereQuantity("di:8"), SphereQuantity("de:8")],
        "45-0": [FortyFiveQuantity("45a:0")],
    }
    names = [name for name in of_each if name in set(instruments)]
    return list(dict.fromkeys(quantity for name in names for quantity in of_each[name]))
