"""How a texture lies on a surface: Mitsuba's `to_uv`, and the directions that belong to it."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Components
from nacre.errors import NacreError, require

_LEAST = 1e-9


class Placement:
    """Coordinates and directions of a texture from those of a surface.

    A texture's x runs along its rows, its y from the last row to the first, as in a photograph;
    Mitsuba's v runs with the rows. Where `to_uv` turns the texture, directions turn too; of what it
    stretches, the nearest turn counts.

    Parameters
    ----------
    mi
        The `mitsuba` module with a JIT variant set.
    to_uv
        Mitsuba's transformation of texture coordinates, of 3 or 4 rows.

    Raises
    ------
    NacreError
        If it maps the plane to less than a plane.
    """

    def __init__(self, mi: Any, to_uv: Any = None) -> None:
        self._mi = mi
        matrix = np.eye(3) if to_uv is None else np.array(to_uv.matrix, np.float64)
        linear, shift = matrix[:2, :2], matrix[:2, -1]
        if not np.isfinite(matrix).all() or abs(np.linalg.det(linear)) < _LEAST:
            raise NacreError("to_uv: leaves nothing of the texture; scale by more than 0")
        self._linear, self._shift = linear.tolist(), shift.tolist()
        left, _, right = np.linalg.svd(linear)
        self._turn = (left @ right).tolist()

    def uv(self, si: Any) -> Any:
        """Texture coordinates of interactions."""
        uv = self.difference(si.uv.x, si.uv.y)
        return self._mi.Point2f(uv.x + self._shift[0], uv.y + self._shift[1])

    def difference(self, u: Any, v: Any) -> Any:
        """Differences of texture coordinates from those of a surface's."""
        (a, b), (c, d) = self._linear
        return self._mi.Point2f(a * u + b * v, c * u + d * v)

    def to_texture(self, si: Any, w: Components) -> Components:
        """A direction of the shading frame in that of the texture."""
        (a, b), (c, d) = self._turn
        y = self._sense(si) * w[1]
        return a * w[0] + b * y, -1.0 * (c * w[0] + d * y), w[2]

    def from_texture(self, si: Any, w: Components) -> Components:
        """Inverse of :meth:`to_texture`."""
        (a, b), (c, d) = self._turn
        return a * w[0] - c * w[1], self._sense(si) * (b * w[0] - d * w[1]), w[2]

    def _sense(self, si: Any) -> Any:
        """1 where v grows along the second axis of the shading frame, -1 where against it."""
        dr = require("drjit", "render")
        along = dr.dot(si.dp_dv, si.sh_frame.t)
        return dr.select(along < 0.0, self._mi.Float(-1.0), 1.0)
