"""Measured directions as triangles on the hemisphere; every direction lies in one of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Components, Floats, aligned_zeros
from nacre.errors import NacreError, require
from nacre.geometry import from_stereographic, join, split, stereographic
from nacre.mitsuba.textures.texels import AlignedBuffer, Corners, jitters

_CELLS = 128  # along an edge of the square that tells where the search for a triangle starts
_STEPS = 4  # triangles to walk through from there; with cells of this size one or two are enough
_FLAT = 1e-7


class Hemisphere:
    """Measured directions around any direction, with spherical barycentric weights.

    The triangles are a Delaunay triangulation of the stereographic projection, which is also one of
    the sphere, for unit vectors of shape (n, 3). A direction outside all triangles, closer to the
    horizon, gets weights on the edge of the nearest one. In stochastic mode one of the three
    directions is chosen with its weight as probability; the same direction always gets the same
    one. Fewer than three directions, or directions that all lie on one circle through the nadir,
    are a :class:`NacreError`.
    """

    def __init__(self, mi: Any, directions: Floats, stochastic: bool) -> None:
        from scipy.spatial import Delaunay, QhullError  # not where no texture is rendered

        self._mi, self._stochastic = mi, stochastic
        directions = directions.astype(np.float64)
        try:
            plane = Delaunay(np.stack(stereographic(split(directions)), axis=-1))
        except (QhullError, ValueError) as error:
            raise NacreError(
                f"{len(directions)} directions span no triangles; interpolation needs three or "
                "more that are not in a row"
            ) from error
        corners = directions[plane.simplices]
        solid = np.abs(np.linalg.det(corners)) > _FLAT
        number = np.cumsum(solid) - 1
        neighbors = plane.neighbors
        known = (neighbors >= 0) & solid[neighbors]
        neighbors = np.where(known, number[neighbors], -1)[solid]
        # Weights w of a direction d are those for which sum w_k v_k = d.
        inverses = np.linalg.inv(corners[solid].swapaxes(1, 2))
        matrices = aligned_zeros((len(inverses), 16), np.float32)
        matrices[:, :9] = inverses.reshape(-1, 9)
        links = aligned_zeros((len(inverses), 8), np.int32)
        links[:, :3], links[:, 3:6] = plane.simplices[solid], neighbors
        self._inverses, self._links = AlignedBuffer(mi, matrices), AlignedBuffer(mi, links)
        axis = (np.arange(_CELLS) + 0.5) * 2.0 / _CELLS - 1.0
        y, x = (part.ravel() for part in np.meshgrid(axis, axis, indexing="ij"))
        self._starts = mi.UInt32(_nearest(inverses, join(from_stereographic(x, y))))

    def around(self, w: Components) -> Corners:
        """Indices and weights of measured directions around a direction."""
        mi, dr = self._mi, require("drjit", "render")
        x, y = (
            mi.UInt32(dr.clip((v + 1.0) * (0.5 * _CELLS), 0.0, _CELLS - 1.0))
            for v in stereographic(w)
        )
        triangle = dr.gather(mi.UInt32, self._starts, y * _CELLS + x)
        weights, corners, neighbors = self._triangle(triangle, w)
        for _ in range(_STEPS):
            beyond = mi.Int32(-1)
            least = mi.Float(0.0)
            for weight, neighbor in zip(weights, neighbors, strict=True):
                beyond = dr.select(weight < least, neighbor, beyond)
                least = dr.minimum(weight, least)
            triangle = dr.select(beyond < 0, triangle, mi.UInt32(beyond))
            weights, corners, neighbors = self._triangle(triangle, w)
        clipped = [dr.maximum(weight, 0.0) for weight in weights]
        scale = 1.0 / dr.maximum(clipped[0] + clipped[1] + clipped[2], 1e-12)
        weights = [weight * scale for weight in clipped]
        if not self._stochastic:
            return list(zip(corners, weights, strict=True))
        (place,) = jitters(mi, (w[0], w[1]), 1)
        others = dr.select(place < weights[0] + weights[1], corners[1], corners[2])
        index = dr.select(place < weights[0], corners[0], others)
        return [(index, mi.Float(1.0))]

    def _triangle(self, triangle: Any, w: Components) -> tuple[list[Any], list[Any], list[Any]]:
        """Weights of the corners of triangles, the corners, and the neighbors opposite to them."""
        m, links = self._inverses[triangle], self._links[triangle]
        weights = [m[3 * k] * w[0] + m[3 * k + 1] * w[1] + m[3 * k + 2] * w[2] for k in range(3)]
        return weights, [self._mi.UInt32(link) for link in links[:3]], links[3:6]


def _nearest(inverses: Floats, directions: Floats) -> Any:
    """The triangle in which each direction lies, or else the one it is least outside of."""
    found = np.empty(len(directions), np.uint32)
    for start in range(0, len(directions), 256):
        part = directions[start : start + 256]
        weights = np.einsum("tij,nj->nti", inverses, part)
        total = weights.sum(2)
        relative = np.where(total > _FLAT, weights.min(2) / np.maximum(total, _FLAT), -np.inf)
        found[start : start + 256] = relative.argmax(1)
    return found
