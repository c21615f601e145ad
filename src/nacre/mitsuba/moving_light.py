"""A scene with a texture under a light that moves from picture to picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from nacre.array import Floats, Image
from nacre.errors import NacreError
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.preview import render_scene
from nacre.mitsuba.textures.scene import facing, light_direction, point_position

PATHS = "around", "over"

_LOWEST = 80.0  # degrees left and right at which the arc over an object begins and ends


def light_path(path: str, count: int, angle: float, geometry: str = "cylinder") -> Floats:
    """Unit vectors toward a moving light, from the object, shape (count, 3).

    Parameters
    ----------
    path
        "around": one rotation about the normal in the middle of the picture, starting where the
        light of a single picture is; "over": a great circle from 80 degrees left to 80 degrees
        right.
    count
        At least 1. Directions "around" are evenly spaced, so that the first follows the last.
    angle
        Degrees between view and light: at the start, or above the view in the middle of "over".
    geometry
        One of :data:`nacre.mitsuba.textures.scene.GEOMETRIES`.

    Raises
    ------
    NacreError
        If there is no such path, or the count is below 1.
    """
    if count < 1:
        raise NacreError(f"a moving light needs at least 1 direction, not {count}")
    if path == "around":
        start, axis = np.array(light_direction(angle)), np.array(facing(geometry))
        angles = (2.0 * math.pi / count * np.arange(count))[:, None]
        along = (start @ axis) * axis  # Rodrigues' formula of a rotation
        rotated = np.cos(angles) * (start - along) + np.sin(angles) * np.cross(axis, start)
        return np.asarray(along + rotated)
    if path == "over":
        aside = np.radians(np.linspace(-_LOWEST, _LOWEST, count))[:, None]
        top = np.array([0.0, math.sin(math.radians(angle)), math.cos(math.radians(angle))])
        return np.asarray(np.sin(aside) * np.array([1.0, 0.0, 0.0]) + np.cos(aside) * top)
    raise NacreError(f"no path {path!r}: choose one of {', '.join(PATHS)}")


def render_moving(
    scene: dict[str, Any],
    directions: Floats,
    spp: int,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Iterator[Image]:
    """Render a scene once for each direction toward its light, shape (n, 3); compiled once.

    The scene comes from :func:`nacre.mitsuba.textures.scene.describe_texture_scene`, with a
    directional or point light; another is a NacreError. Pictures are linear Rec. 709 RGB, float32,
    shape (height, width, 3). All use the samples of one seed, so that noise stands still except
    where it depends on the light. `progress` gets the finished fraction of all pictures.
    """
    mi = mitsuba()
    loaded = mi.load_dict(scene)
    parameters = mi.traverse(loaded)
    for index, toward in enumerate(directions):
        _move(mi, parameters, toward)
        yield render_scene(loaded, spp, seed)
        if progress is not None:
            progress((index + 1) / len(directions))


def _move(mi: Any, parameters: Any, toward: Floats) -> None:
    if "light.position" in parameters:
        parameters["light.position"] = mi.Point3f(point_position(toward))
    elif "light.irradiance.value" in parameters:
        up = np.eye(3)[np.argmin(np.abs(toward))]
        target = [-float(x) for x in toward]
        toward_origin = mi.ScalarTransform4f().look_at([0, 0, 0], target, up.tolist())
        parameters["light.to_world"] = mi.Transform4f(toward_origin)
    else:
        raise NacreError("an environment does not move: choose a directional or a point light")
    parameters.update()
