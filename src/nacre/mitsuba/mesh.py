"""Triangle meshes for Mitsuba, made from formulas."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.array import Floats

_SEGMENTS = 384


def revolve(mi: Any, name: str, profile: Floats, bsdf: Any, to_world: Any = None) -> Any:
    """Surface of revolution about +y as a `mitsuba.Mesh` with smooth normals.

    The profile is radii and heights along the curve, shape (n, 2); the outside is to the left of
    the curve in the (radius, height) plane.
    """
    phi = np.linspace(0.0, 2.0 * math.pi, _SEGMENTS + 1)

    def turned(curve: Floats) -> Floats:
        out, up = curve[:, None, 0], curve[:, None, 1]
        return np.stack(np.broadcast_arrays(out * np.sin(phi), up, out * np.cos(phi)), axis=-1)

    v = np.linspace(0.0, 1.0, len(profile))[:, None]
    uv = np.stack(np.broadcast_arrays(phi / (2.0 * math.pi), v), axis=-1)
    slope = np.gradient(profile, axis=0)
    outward = np.stack([-slope[:, 1], slope[:, 0]], axis=-1)
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    return grid_mesh(mi, name, turned(profile), uv, bsdf, turned(outward), to_world)


def grid_mesh(
    mi: Any,
    name: str,
    positions: Floats,
    uv: Floats,
    bsdf: Any,
    normals: Floats | None = None,
    to_world: Any = None,
) -> Any:
    """A grid of quadrilaterals, two triangles each, as a `mitsuba.Mesh`.

    Vertices have positions and normals, shapes (rows, columns, 3), and uv, (rows, columns, 2).
    """
    rows, columns, _ = positions.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below = corner + columns
    faces = np.concatenate(
        [np.stack([corner, below, below + 1], 1), np.stack([corner, below + 1, corner + 1], 1)]
    )
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf) if isinstance(bsdf, dict) else bsdf
    mesh = mi.Mesh(
        name,
        vertex_count=rows * columns,
        face_count=len(faces),
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=True,
        props=properties,
    )
    if to_world is not None:  # rotations and translations only: normals turn with the positions
        matrix = np.array(to_world.matrix)
        positions = positions @ matrix[:3, :3].T + matrix[:3, 3]
        normals = None if normals is None else normals @ matrix[:3, :3].T
    parameters = mi.traverse(mesh)
    vertices = {"positions": positions, "texcoords": uv, "normals": normals}
    for of, values in vertices.items():
        if values is not None:
            parameters[f"vertex_{of}"] = values.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh
