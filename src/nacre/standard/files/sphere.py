"""A sphere made of triangles, for showing a material."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

_SEGMENTS, _RINGS = 64, 32


@dataclass(frozen=True)
class Mesh:
    """Triangles with attributes for shading.

    Parameters
    ----------
    positions, normals
        Shape (n, 3), float32; y is up.
    tangents
        Shape (n, 4), float32: the direction in which u grows, and 1 if the bitangent is normal x
        tangent.
    uv
        Texture coordinates, shape (n, 2), float32; v grows downward.
    triangles
        Indices, shape (m, 3), uint16; counterclockwise seen from outside.
    """

    positions: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    tangents: npt.NDArray[np.float32]
    uv: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.uint16]


def sphere() -> Mesh:
    """The unit sphere in rings of latitude; tangents point east."""
    columns, rows = np.arange(_SEGMENTS + 1), np.arange(_RINGS + 1)
    u, v = np.meshgrid(columns / _SEGMENTS, rows / _RINGS)
    u[0] += 0.5 / _SEGMENTS  # each triangle has its own vertex at the pole, at its middle
    u[-1] -= 0.5 / _SEGMENTS
    theta, phi = math.pi * v, 2.0 * math.pi * u
    up, radius, east = np.cos(theta), np.sin(theta), np.zeros_like(u)
    radius[[0, -1]] = 0.0
    points = np.stack([-radius * np.cos(phi), up, radius * np.sin(phi)], axis=-1)
    tangents = np.stack([np.sin(phi), east, np.cos(phi), east + 1.0], axis=-1)
    corner = (np.arange(_RINGS)[:, None] * (_SEGMENTS + 1) + np.arange(_SEGMENTS)).reshape(-1)
    below = corner + _SEGMENTS + 1
    upper = np.stack([corner, below + 1, corner + 1], axis=1)[_SEGMENTS:]
    lower = np.stack([corner, below, below + 1], axis=1)[:-_SEGMENTS]
    triangles = np.concatenate([lower, upper])

    def flat(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
        return values.reshape(-1, values.shape[-1]).astype(np.float32)

    positions = flat(points)
    return Mesh(
        positions,
        positions,
        flat(tangents),
        flat(np.stack([u, v], axis=-1)),
        triangles.astype(np.uint16),
    )
