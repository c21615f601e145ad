"""Scenes of one material for viewers of glTF: a plane of many directions, and the sphere."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.array import Floats, Vectors
from nacre.standard.files.glb import container, encode
from nacre.standard.files.sphere import Mesh
from nacre.standard.gltf import Gltf

DISTANCE = 0.35
"""Of the camera from the plane, whose part it sees reaches 1 from the middle."""


def plane() -> Mesh:
    """A square of side 2 that faces +z; tangents point along +x."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32)
    zero, one = np.zeros((4, 1), np.float32), np.ones((4, 1), np.float32)
    return Mesh(
        np.hstack([corners, zero]),
        np.hstack([zero, zero, one]),
        np.hstack([one, zero, zero, one]),
        (corners * (0.5, -0.5) + 0.5).astype(np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.uint16),
    )


def scene(
    brdf: Gltf, light: Sequence[float], distance: float, angle: float, mesh: Mesh | None = None
) -> bytes:
    """A `.glb` of a mesh, a camera on +z that looks at it, and a directional light of 1 lux.

    Parameters
    ----------
    brdf
        The material.
    light
        Unit vector to the light.
    distance
        Of the camera from the origin.
    angle
        Of its square picture, in radians.
    mesh
        By default the sphere of :func:`nacre.standard.files.glb.encode`.
    """
    data = encode(brdf, mesh)
    length = struct.unpack_from("<I", data, 12)[0]
    content: dict[str, Any] = json.loads(data[20 : 20 + length])
    camera = {"yfov": angle, "aspectRatio": 1.0, "znear": 0.01, "zfar": 100.0}
    content["cameras"] = [{"type": "perspective", "perspective": camera}]
    content["nodes"] += [
        {"camera": 0, "translation": [0.0, 0.0, distance]},
        {"rotation": _rotation(light), "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]
    content["scenes"] = [{"nodes": [0, 1, 2]}]
    content["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "directional"}]}}
    content["extensionsUsed"] = [*content.get("extensionsUsed", []), "KHR_lights_punctual"]
    return container(content, data[28 + length :])


def _rotation(light: Sequence[float]) -> list[float]:
    """Quaternion (x, y, z, w) that takes +z to the light: lights shine along -z."""
    x, y, z = light
    scale = 1.0 / math.sqrt(2.0 * (1.0 + z))
    return [-y * scale, x * scale, 0.0, (1.0 + z) * scale]


def plane_scene(brdf: Gltf, light: Sequence[float]) -> bytes:
    """The plane, seen by a camera close to it."""
    return scene(brdf, light, DISTANCE, 2.0 * math.atan(1.0 / DISTANCE), plane())


def plane_views(size: int) -> Vectors:
    """Directions from the pixels of the plane's picture to the camera, shape (size, size, 3)."""
    line = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    x, y = np.meshgrid(line, -line)
    views = np.stack([-x, -y, np.full_like(x, DISTANCE)], axis=-1)
    return views / np.linalg.norm(views, axis=-1, keepdims=True)


def sphere_views(size: int, distance: float, angle: float) -> tuple[Floats, Vectors, Vectors]:
    """Which pixels see the unit sphere; the normals there and directions to the camera, (n, 3)."""
    line = ((np.arange(size) + 0.5) / size * 2.0 - 1.0) * math.tan(angle / 2.0)
    x, y = np.meshgrid(line, -line)
    ray = np.stack([x, y, -np.ones_like(x)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    along = -ray[..., 2] * distance
    inside = along**2 - (distance**2 - 1.0)
    points = (along - np.sqrt(np.maximum(inside, 0.0)))[..., None] * ray
    points[..., 2] += distance
    seen = inside > 0.0
    return seen, points[seen], -ray[seen]


def frames(normals: Vectors) -> Floats:
    """Axes of the sphere: tangent to the east, bitangent to the north, normal; shape (n, 3, 3)."""
    x, y, z = np.moveaxis(normals, -1, 0)
    tangents = np.stack([z, np.zeros_like(y), -x], axis=-1) / np.hypot(x, z)[..., None]
    return np.stack([tangents, np.cross(normals, tangents), normals], axis=-2)
