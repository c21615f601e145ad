"""Sets of directions at which gonioreflectometers measure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.measured.textures.directions import from_degrees


@dataclass(frozen=True)
class Dome:
    """Rings of directions around the normal; each serves as light and as view.

    Rings come in the order of the directions: polar angle in degrees, number of directions, azimuth
    of the first in degrees. The others follow at equal steps.
    """

    name: str
    rings: tuple[tuple[float, int, float], ...]

    @property
    def directions(self) -> Floats:
        """Unit vectors, ring after ring, shape (k, 3)."""
        theta = np.concatenate([np.full(count, polar) for polar, count, _ in self.rings])
        phi = np.concatenate([first + np.arange(n) * (360.0 / n) for _, n, first in self.rings])
        return from_degrees(theta, phi).astype(np.float32)

    def pairs(self) -> tuple[Floats, Floats]:
        return pairs(self.directions, self.directions)


def pairs(lights: Floats, views: Floats) -> tuple[Floats, Floats]:
    """Each light with each view: `wi` and `wo`, shapes (lights x views, 3), the light fastest."""
    return np.tile(lights, (len(views), 1)), np.repeat(views, len(lights), axis=0)


def below(directions: Floats, degrees: float) -> npt.NDArray[np.bool_]:
    """Which directions lie within an angle of the normal."""
    return np.asarray(directions[..., 2] >= math.cos(math.radians(degrees)) - 1e-6)


BONN = Dome(
    "Bonn UBO2014",
    (
        (0.0, 1, 0.0),
        (11.0, 6, 15.0),
        (23.5, 12, 0.0),
        (30.0, 12, 15.0),
        (37.5, 12, 0.0),
        (45.0, 18, 0.0),
        (52.5, 18, 7.5),
        (60.0, 24, 0.0),
        (67.5, 24, 7.5),
        (75.0, 24, 0.0),
    ),
)
"""151 directions of the database UBO2014 (Weinmann, Gall and Klein 2014)."""

UTIA = Dome(
    "UTIA",
    (
        (0.0, 1, 0.0),
        (15.0, 6, 0.0),
        (30.0, 12, 0.0),
        (45.0, 18, 0.0),
        (60.0, 20, 0.0),
        (75.0, 24, 0.0),
    ),
)
"""81 directions of the UTIA BTF database, which are those of Bonn's of 2003."""
