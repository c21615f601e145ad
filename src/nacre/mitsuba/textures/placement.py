"""How a texture lies on a surface: `to_uv`, directions, and how much of it a pixel sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.errors import NacreError, require

_MIN_DETERMINANT = 1e-9
_MIN_COSINE = 0.02  # cosine of the view below which footprints stop growing


class Placement:
    """Coordinates and directions on a texture, from those on a surface.

    A texture's x runs along its rows and its y from the last row to the first, as in a photograph;
    Mitsuba's v runs with the rows. If `to_uv`, Mitsuba's transformation with 3 or 4 rows, rotates
    the texture, directions rotate too, by the rotation nearest to it if it also stretches. A
    `to_uv` that collapses the plane is a :class:`NacreError`.
    """

    def __init__(self, mi: Any, to_uv: Any = None) -> None:
        self._mi = mi
        matrix = np.eye(3) if to_uv is None else np.array(to_uv.matrix, np.float64)
        linear, shift = matrix[:2, :2], matrix[:2, -1]
        if not np.isfinite(matrix).all() or abs(np.linalg.det(linear)) < _MIN_DETERMINANT:
            raise NacreError("to_uv: leaves nothing of the texture; scale by more than 0")
        self._linear, self._shift = linear.tolist(), shift.tolist()
        left, _, right = np.linalg.svd(linear)
        self._rotation = (left @ right).tolist()

    def uv(self, si: Any) -> Any:
        """Texture coordinates at interactions."""
        uv = self.difference(si.uv.x, si.uv.y)
        return self._mi.Point2f(uv.x + self._shift[0], uv.y + self._shift[1])

    def difference(self, u: Any, v: Any) -> Any:
        """A difference of texture coordinates, from one of surface coordinates."""
        (a, b), (c, d) = self._linear
        return self._mi.Point2f(a * u + b * v, c * u + d * v)

    def to_texture(self, si: Any, w: Components) -> Components:
        """From the shading frame to the texture's frame."""
        (a, b), (c, d) = self._rotation
        y = self._sense(si) * w[1]
        return a * w[0] + b * y, -1.0 * (c * w[0] + d * y), w[2]

    def from_texture(self, si: Any, w: Components) -> Components:
        """Inverse of :meth:`to_texture`."""
        (a, b), (c, d) = self._rotation
        return a * w[0] - c * w[1], self._sense(si) * (b * w[0] - d * w[1]), w[2]

    def _sense(self, si: Any) -> Any:
        """1 where v grows along the second axis of the shading frame, else -1."""
        dr = require("drjit", "render")
        along = dr.dot(si.dp_dv, si.sh_frame.t)
        return dr.select(along < 0.0, self._mi.Float(-1.0), 1.0)


@dataclass(frozen=True)
class Footprint:
    """The parallelogram around a texture point that a pixel sees.

    `long` is its longer side in texture coordinates, `mi.Point2f`; `texels` are the lengths of the
    longer and the shorter side in texels.
    """

    long: Any
    texels: tuple[Any, Any]


def footprint(
    mi: Any, si: Any, placement: Placement, angle: float, height: int, width: int
) -> Footprint:
    """The footprint of a cone of rays, with an angle in radians between neighboring pixels.

    Akenine-Moller et al. 2021, "Improved Shader and Texture Level of Detail Using Ray Cones". A
    cone restarts at each hit of a path, so footprints after the first hit are smaller than they
    could be, which only slows convergence.
    """
    dr = require("drjit", "render")
    view, normal = si.to_world(si.wi), si.sh_frame.n
    cosine = dr.dot(view, normal)
    along = view - normal * cosine
    upright = dr.squared_norm(along) < 1e-8
    along = dr.normalize(dr.select(upright, si.sh_frame.s, along))
    across = dr.cross(normal, along)
    spread = angle * si.t
    sides = []
    for side in (along * (spread / dr.maximum(dr.abs(cosine), _MIN_COSINE)), across * spread):
        u, v = (
            dr.dot(side, axis) / dr.maximum(dr.squared_norm(axis), 1e-20)
            for axis in (si.dp_du, si.dp_dv)
        )
        uv = placement.difference(u, v)
        sides.append((uv, dr.norm(mi.Point2f(uv.x * width, uv.y * height))))
    (one, first), (other, second) = sides
    longer = first > second
    return Footprint(
        dr.select(longer, one, other), (dr.maximum(first, second), dr.minimum(first, second))
    )
