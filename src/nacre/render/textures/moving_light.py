"""One scene of a texture under a light that moves from picture to picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from nacre.array import Floats, Image
from nacre.errors import NacreError
from nacre.render.engine import mitsuba
from nacre.render.preview import render_scene
from nacre.render.textures.scene import facing, light_direction, point_position

PATHS = "around", "over"

_LOWEST = 80.0
"""Degrees to the left and to the right at which the arc over an object begins and ends."""


def light_path(path: str, count: int, angle: float, geometry: str = "cylinder") -> Floats:
    """Directions toward a light on its way.

    Parameters
    ----------
    path
        "around": one rotation about the normal in the middle of the picture, from where the light
        of a single picture is; "over": on a great circle from 80 degrees to the left to 80 to the
        right.
    count
        Directions, at least 1. Those around are evenly spaced, so that the first follows the last.
    angle
        Degrees between the view and the light: at the start, or in the middle of the way over,
        above the view.
    geometry
        One of :data:`nacre.render.textures.scene.GEOMETRIES`.

    Returns
    -------
    array of shape (count, 3)
        Unit vectors, from the object.

    Raises
    ------
    NacreError
        If there is no such path, or no direction is asked for.
    """
    if count < 1:
        raise NacreError(f"a light on its way has 1 direction or more, not {count}")
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
    """Render a scene once for each direction of its light, compiled once.

    All pictures have the samples of one seed: their noise stands still, but for what depends on the
    direction of the light.

    Parameters
    ----------
    scene
        Of :func:`nacre.render.textures.scene.describe_texture_scene`, with a directional or point
        light.
    directions
        Toward the light, shape (n, 3).
    spp
        Samples per pixel, at least 1.
    seed
        Of the samples.
    progress
        Called with the fraction of all pictures that is done.

    Yields
    ------
    array of shape (height, width, 3)
        Linear Rec. 709 RGB, float32.

    Raises
    ------
    NacreError
        If the light of the scene has no place of its own.
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
