"""Apertures of sources and receptors, as sets of directions with weights.

The light is at azimuth 0, so the plane of incidence is that of x and z, and the receptors of
glossmeters stand at azimuth 180 degrees. Directions have shape (n, 3), weights are solid angles in
sr, shape (n,).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nacre.array import Doubles
from nacre.geometry import join, rotate, split
from nacre.instruments.quadrature import EXACT, Rule, circle, graded, on_interval


def frame(polar: float) -> Doubles:
    """The in-plane tangent, the perpendicular and the direction itself at an angle from the normal.

    Rows of (3, 3). The angle is in degrees, negative at azimuth 180 degrees; the tangent points to
    larger ones.
    """
    sine, cosine = math.sin(math.radians(polar)), math.cos(math.radians(polar))
    return np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])


@dataclass(frozen=True)
class Rectangle:
    """A rectangular field stop in the focal plane of a lens: directions in a rectangle.

    Parameters
    ----------
    polar
        Angle of its center from the normal, in degrees; negative at azimuth 180 degrees.
    in_plane, across
        Full angles in the plane of incidence and perpendicular to it, in degrees. As in ISO 2813,
        an edge is 2 tan(angle / 2) focal lengths long.
    """

    polar: float
    in_plane: float
    across: float

    @property
    def edges(self) -> tuple[float, float]:
        """Halves of the edges in focal lengths."""
        halves = (math.tan(0.5 * math.radians(angle)) for angle in (self.in_plane, self.across))
        first, second = halves
        return first, second

    def smooth(self, counts: tuple[int, int] = (4, 6)) -> tuple[Doubles, Doubles]:
        """Directions and weights for functions that are smooth over the aperture."""
        return self._product(
            *(on_interval(-h, h, n) for h, n in zip(self.edges, counts, strict=True))
        )

    def around(self, peak: Doubles, rule: Rule = EXACT) -> tuple[Doubles, Doubles]:
        """Directions and weights for functions that may be sharp at a direction, (3,)."""
        place = self.place(peak)
        edges = zip(self.edges, place, strict=True)
        return self._product(*(graded(-h, h, p, rule.finest) for h, p in edges))

    def place(self, direction: Doubles) -> tuple[float, float]:
        """Where light from a direction, (3,), meets the focal plane, in focal lengths."""
        x, y, z = frame(self.polar) @ direction
        return float(x / z), float(y / z)

    def holds(self, directions: Doubles) -> Doubles:
        """1 for each of (n, 3) that is in the aperture, else 0."""
        x, y, z = frame(self.polar) @ directions.T
        first, second = self.edges
        return np.asarray(
            (z > 0.0) & (abs(x) <= first * z) & (abs(y) <= second * z), dtype=np.float64
        )

    def _product(
        self, first: tuple[Doubles, Doubles], second: tuple[Doubles, Doubles]
    ) -> tuple[Doubles, Doubles]:
        x, y = (grid.reshape(-1) for grid in np.meshgrid(first[0], second[0], indexing="ij"))
        length = np.sqrt(1.0 + x * x + y * y)
        directions = np.stack([x, y, np.ones_like(x)], axis=1) / length[:, None]
        weights = np.outer(first[1], second[1]).reshape(-1) / length**3
        return directions @ frame(self.polar), weights


def ring(inner: float, outer: float, counts: tuple[int, int]) -> tuple[Doubles, Doubles]:
    """Directions between two cones about the normal, of half angles in degrees, and weights.

    `counts` are the nodes from cone to cone and around; an inner angle of 0 makes a full cone.
    """
    cosines, widths = on_interval(
        math.cos(math.radians(outer)), math.cos(math.radians(inner)), counts[0]
    )
    phi, step = circle(counts[1])
    z, phi = (grid.reshape(-1) for grid in np.meshgrid(cosines, phi, indexing="ij"))
    sine = np.sqrt(1.0 - z * z)
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=1)
    return directions, np.repeat(widths, counts[1]) * step


def cone(polar: float, half_angle: float, counts: tuple[int, int]) -> tuple[Doubles, Doubles]:
    """Directions in a cone whose axis is `polar` degrees from the normal at azimuth 0; see
    :func:`ring`.
    """
    directions, weights = ring(0.0, half_angle, counts)
    return directions @ frame(polar), weights


def turned(directions: Doubles, azimuth: float) -> Doubles:
    """Directions (n, 3) rotated about the normal by an angle in degrees."""
    return np.asarray(join(rotate(split(directions), math.radians(azimuth))), np.float64)


def mirrored(directions: Doubles) -> Doubles:
    """Where a plane mirror sends light from directions (n, 3)."""
    return np.asarray(directions * np.array([-1.0, -1.0, 1.0]))
