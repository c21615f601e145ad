"""Matrices of LBNL's WINDOW: f_r constant on pairs of patches of the hemisphere.

A basis cuts the hemisphere into rings of the polar angle and these into patches, the first centered
at azimuth 0. An entry is f_r in 1/sr for an incident and an outgoing patch; the azimuth of the
incident one is that of the light as it travels on, so that patches of one number are opposite.
Klems 1994, "A New Method for Predicting the Solar Heat Gain of Complex Fenestration Systems";
Radiance's bsdf_m.c, which the tests compare with.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, Table, namespace
from nacre.geometry import to_spherical
from nacre.measured.axis import zero_index
from nacre.sampling import LobeSampledBrdf

_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Basis:
    """Rings of patches: the bounds of their polar angles in degrees, from 0 to 90, and the number
    of patches in each.
    """

    bounds: tuple[float, ...]
    counts: tuple[int, ...]

    def __post_init__(self) -> None:
        increasing = all(a < b for a, b in zip(self.bounds, self.bounds[1:], strict=False))
        if len(self.bounds) != len(self.counts) + 1 or not increasing:
            raise ValueError("polar angles of rings must increase")
        if self.bounds[0] != 0.0 or abs(self.bounds[-1] - 90.0) > 1e-3:
            raise ValueError("rings must reach from 0 to 90 degrees")
        if not all(1 <= count <= 1024 for count in self.counts) or self.patches > 4096:
            raise ValueError("rings must have 1 to 1024 patches, 4096 in all")

    @property
    def patches(self) -> int:
        return sum(self.counts)


BASES = {
    "LBNL/Klems Full": Basis(
        (0, 5, 15, 25, 35, 45, 55, 65, 75, 90), (1, 8, 16, 20, 24, 24, 24, 16, 12)
    ),
    "LBNL/Klems Half": Basis((0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90), (1, 8, 12, 16, 20, 12, 8)),
    "LBNL/Klems Quarter": Basis((0, 9, 27, 45, 63, 90), (1, 8, 12, 12, 8)),
}
"""The usual bases, for files that name one without its rings."""


class KlemsBrdf(LobeSampledBrdf):
    """A reflectance that is constant on pairs of patches.

    Parameters
    ----------
    matrix
        f_r in 1/sr, linear Rec. 709 RGB, shape (outgoing patches, incident patches, 3).
    incident, outgoing
        Their bases. As in Radiance, which follows light backward, the incident direction is that of
        the view, and the outgoing one that of the light; it matters where f_r is not reciprocal.
    """

    isotropic = False
    isotropy_known = True

    def __init__(
        self, matrix: npt.ArrayLike, incident: Basis, outgoing: Basis, name: str = ""
    ) -> None:
        super().__init__(name=name)
        values = np.clip(np.asarray(matrix, np.float64), -_LARGEST, _LARGEST).astype(np.float32)
        if values.shape != (outgoing.patches, incident.patches, 3):
            raise ValueError(f"a matrix of shape {values.shape} does not fit its bases")
        self.incident, self.outgoing = incident, outgoing
        self._range = float(values.min()), float(values.max())
        self._matrix = Table(values.reshape(-1))
        self._bases = _Finder(incident), _Finder(outgoing)

    @property
    def matrix(self) -> Floats:
        """f_r in 1/sr, shape (outgoing patches, incident patches, 3)."""
        shape = self.outgoing.patches, self.incident.patches, 3
        return np.asarray(self._matrix.values).reshape(shape)

    @property
    def nbytes(self) -> int:
        return int(self._matrix.values.nbytes)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        column = self._bases[0].patch((-wo[0], -wo[1], wo[2]))
        row = self._bases[1].patch(wi)
        place = 3 * (row * self.incident.patches + column)
        # There is no slope, which is not the same as no gradient.
        flat = 0.0 * (wi[0] + wo[0])
        red, green, blue = (xp.take(self._matrix, place + c) + flat for c in range(3))
        return red, green, blue

    def describe(self) -> dict[str, object]:
        patches = f"{self.outgoing.patches} x {self.incident.patches} patches"
        return super().describe() | {"matrix": patches, "value range": [*self._range]}


class _Finder:
    """Finds patches of a basis on any array library."""

    def __init__(self, basis: Basis) -> None:
        self._cosines = [math.cos(math.radians(bound)) for bound in basis.bounds[1:-1]]
        self._counts = Table(np.array(basis.counts, np.float32))
        self._starts = Table(np.cumsum([0, *basis.counts[:-1]]).astype(np.float32))

    def patch(self, w: Components) -> Array:
        """Number of the patch that a direction lies in."""
        xp = namespace(*w)
        zero = zero_index(w[0] + w[1] + w[2])
        ring = zero
        for cosine in self._cosines:
            ring = ring + xp.to_index(xp.where(w[2] < cosine, 1.0, 0.0))
        count, start = xp.take(self._counts, ring), xp.take(self._starts, ring)
        turn = to_spherical(w)[1] / (2.0 * math.pi)
        turn = xp.where(turn < 0.0, turn + 1.0, turn)
        step = xp.to_index(xp.minimum(turn * count + 0.5, count + 0.25))
        step = xp.where(step >= xp.to_index(count), zero, step)
        return xp.to_index(start) + step
