"""Scenes that show a texture: on a cylinder, as in the papers, a sphere, a plane, or the ground.

+y is up and the camera looks toward -z, as in :mod:`nacre.mitsuba.scene`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.scene import (
    camera,
    check_name,
    directional,
    emitter,
    floor,
    matte,
    path_traced,
    rgb,
    upright_sphere,
)

GEOMETRIES = "cylinder", "sphere", "plane", "ground"
LIGHTS = "environment", "directional", "point"

_RADIUS, _HEIGHT = 0.75, 2.1  # of the cylinder
_PLANE = 1.3  # half an edge of the plane
_GROUND = 40.0  # half an edge of the ground
_FIELD = 20.0  # degrees that the shorter edge of the picture sees
_DISTANCE = 12.0  # of the point light, from the object's middle
_TILT = 35.0  # degrees from upright by which the plane leans back


def texture_scale(geometry: str, repeat: int, aspect: float = 1.0) -> Any:
    """The `to_uv` that repeats a texture `repeat` times around or along a geometry, upright.

    On the ground it is as large as on the plane. `repeat` is a whole number, so that the texture
    meets itself behind a cylinder or a sphere. `aspect`, the texture's width over its height, keeps
    its proportions; on a sphere, those at the equator. Raises NacreError if the geometry is not one
    of :data:`GEOMETRIES`, or `repeat` is less than 1.
    """
    if repeat < 1:
        raise NacreError(f"a texture is repeated at least once, not {repeat} times")
    check_name("geometry", geometry, GEOMETRIES)
    around = -_HEIGHT / (2.0 * math.pi * _RADIUS)  # v runs upwards, rows do not
    upward = {"cylinder": around, "sphere": 0.5}.get(geometry, -1.0)
    across = float(repeat) * (_GROUND / _PLANE if geometry == "ground" else 1.0)
    return mitsuba().ScalarTransform4f().scale([across, upward * across * aspect, 1.0])


def describe_texture_scene(
    bsdf: Any,
    geometry: str = "cylinder",
    light: str = "environment",
    size: tuple[int, int] = (512, 512),
    angle: float = 45.0,
    environment: Environment | None = None,
    *,
    standing: bool = True,
) -> dict[str, Any]:
    """Scene dictionary for `mitsuba.load_dict`, with a BSDF or the dictionary of one.

    Parameters
    ----------
    geometry
        One of :data:`GEOMETRIES`.
    light
        "environment"; or "directional" or "point", with irradiance pi at the object's middle.
    size
        Width and height in pixels.
    angle
        Degrees from the view to a directional or point light, to the upper left.
    environment
        The map, exposed here; by default the package's own.
    standing
        Whether objects other than the ground stand on a floor, which blocks light from below.

    Raises
    ------
    NacreError
        If there is no such geometry or light.
    """
    check_name("geometry", geometry, GEOMETRIES)
    check_name("light", light, LIGHTS)
    mi = mitsuba()
    return {
        **path_traced(6, camera([0.0, 2.0, 7.6], [0.0, 1.04, 0.0], _FIELD, size, "smaller")),
        "light": _light(mi, light, angle, environment),
        **({"floor": floor(mi)} if standing and geometry != "ground" else {}),
        **_object(mi, geometry, bsdf),
    }


def pixel_angle(size: tuple[int, int]) -> float:
    """Degrees between neighboring pixels of a picture with some width and height."""
    return _FIELD / min(size)


def light_direction(angle: float) -> list[float]:
    """Toward a light some degrees from the view, to the upper left."""
    aside = math.sqrt(0.5) * math.sin(math.radians(angle))
    return [-aside, aside, math.cos(math.radians(angle))]


def facing(geometry: str) -> list[float]:
    """The normal of a geometry in the middle of the picture."""
    tilt = math.radians({"plane": _TILT, "ground": 90.0}.get(geometry, 0.0))
    return [0.0, math.sin(tilt), math.cos(tilt)]


def point_position(toward: Sequence[float] | Floats) -> list[float]:
    """The position of the point light in some direction from the object's middle."""
    middle = (0.0, 1.0, 0.0)
    return [_DISTANCE * float(x) + y for x, y in zip(toward, middle, strict=True)]


def _light(mi: Any, light: str, angle: float, environment: Environment | None) -> dict[str, Any]:
    if light == "environment":
        return emitter(mi, light, environment)
    toward = light_direction(angle)
    if light == "directional":
        return directional(toward)
    intensity = rgb(math.pi * _DISTANCE**2)
    return {"type": "point", "position": point_position(toward), "intensity": intensity}


def _object(mi: Any, geometry: str, bsdf: Any) -> dict[str, Any]:
    place = mi.ScalarTransform4f()
    if geometry == "sphere":
        return {"object": upright_sphere(mi, bsdf)}
    places = {
        "plane": place.translate([0, 1.08, 0]).rotate([1, 0, 0], -_TILT).scale(_PLANE),
        "ground": place.rotate([1, 0, 0], -90.0).scale(_GROUND),
    }
    if geometry in places:
        return {"object": {"type": "rectangle", "to_world": places[geometry], "bsdf": bsdf}}
    ends = {"p0": [0, 0, 0], "p1": [0, _HEIGHT, 0], "radius": _RADIUS}
    lid = place.translate([0, _HEIGHT, 0]).rotate([1, 0, 0], -90.0).scale(_RADIUS)
    return {
        "object": {"type": "cylinder", **ends, "bsdf": bsdf},
        "lid": {"type": "disk", "to_world": lid, "bsdf": matte(0.05)},
    }
