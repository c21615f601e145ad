"""Triangle meshes for Mitsuba, made from formulas."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

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
    if to_world is not None:  # rotations and translations only: normals turn with the positions
        matrix = np.array(to_world.matrix)
        positions = positions @ matrix[:3, :3].T + matrix[:3, 3]
        normals = None if normals is None else normals @ matrix[:3, :3].T
    return triangle_mesh(mi, name, positions, faces, bsdf, uv, normals)


def triangle_mesh(
    mi: Any,
    name: str,
    positions: Floats,
    faces: npt.NDArray[np.integer],
    bsdf: Any,
    uv: Floats | None = None,
    normals: Floats | None = None,
) -> Any:
    """Triangles as a `mitsuba.Mesh`, flat unless vertices have normals.

    Positions and normals have shape (..., 3), uv (..., 2), faces (n, 3): numbers of vertices. The
    mesh goes through a file, because how meshes are made in memory differs between releases of
    Mitsuba.
    """
    given = {"xyz": positions, ("nx", "ny", "nz"): normals, "uv": uv}
    vertices = {axes: values for axes, values in given.items() if values is not None}
    columns = [values.reshape(-1, len(axes)) for axes, values in vertices.items()]
    corners = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    corners["count"], corners["corners"] = 3, faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(columns[0])}",
        *(f"property float {axis}" for axes in vertices for axis in axes),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mesh.ply")
        values = np.concatenate(columns, axis=1).astype("<f4")
        path.write_bytes("\n".join(header).encode() + values.tobytes() + corners.tobytes())
        # The material is made first, and named last: its id may be that of the mesh.
        made = mi.load_dict(bsdf) if isinstance(bsdf, dict) else bsdf
        called = bsdf.get("id", "") if isinstance(bsdf, dict) else bsdf.id()
        described = {"type": "ply", "id": name, "filename": str(path), "bsdf": made}
        mesh = mi.load_dict(described | {"face_normals": normals is None})
        mesh.bsdf().set_id(called)
        return mesh
