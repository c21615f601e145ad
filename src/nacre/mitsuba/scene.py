"""Mitsuba scenes that show a material: its object, light and camera.

Scenes have the orientation of :mod:`nacre.mitsuba.environment`: +y is up and the camera looks
toward -z, so the lamps of the environment are behind it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.errors import NacreError, did_you_mean
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.mesh import grid_mesh, revolve
from nacre.mitsuba.studio import studio

SHAPES = "ball", "sphere"
LIGHTS = "environment", "directional"


_GROOVE = (math.radians(62.0), math.radians(77.0))
_GROOVE_EDGE = math.radians(1.6)
_GROOVE_DEPTH = 0.14
_BALL_TILT = (34.0, -24.0)

_FLOOR_FRONT, _FLOOR_BACK, _FLOOR_BEND, _FLOOR_WIDTH = 9.0, 5.0, 3.2, 26.0
_FLOOR_GRAY, _FLOOR_TEXELS = 0.36, 2048
_CHECK, _CHECK_CONTRAST, _CHECK_FADE = 0.5, 0.055, 2.6

PATH_DEPTH = 6
"""The most segments of a path in :func:`describe_scene`."""

EXPOSURE = 0.6
"""Mean luminance to which the environment is exposed; light from the floor brings a white
Lambertian ball to about 0.8."""


def describe_scene(
    bsdf: Any,
    shape: str = "ball",
    light: str = "environment",
    size: tuple[int, int] = (512, 512),
    environment: Environment | None = None,
) -> dict[str, Any]:
    """Scene dictionary for `mitsuba.load_dict`, with a BSDF or the dictionary of one.

    The shape is `"ball"`, grooved and on a ring, or `"sphere"`, plain and on the floor. The light
    is `"environment"`, a map that is exposed here (by default the package's own), or
    `"directional"`, like :class:`nacre.mitsuba.lights.DirectionalLight`. The size is width and
    height in pixels. Raises NacreError for another shape or light.
    """
    check_name("shape", shape, SHAPES)
    check_name("light", light, LIGHTS)
    mi = mitsuba()
    return {
        **path_traced(
            PATH_DEPTH, camera([0.0, 2.55, 7.6], [0.0, 0.97, 0.0], 24.0, size, "smaller")
        ),
        "light": emitter(mi, light, environment),
        "floor": floor(mi),
        **(_ball(mi, bsdf) if shape == "ball" else {"sphere": upright_sphere(mi, bsdf)}),
    }


def path_traced(depth: int, sensor: Mapping[str, Any]) -> dict[str, Any]:
    """The start of a scene: a path tracer with at most `depth` segments, and its sensor."""
    integrator = {"type": "path", "max_depth": depth}
    return {"type": "scene", "integrator": integrator, "sensor": sensor}


def rgb(*value: float) -> dict[str, Any]:
    """A linear color, or one value for all channels."""
    return {"type": "rgb", "value": list(value) if len(value) > 1 else value[0]}


def upright_sphere(mi: Any, bsdf: Any) -> dict[str, Any]:
    """The unit sphere on the floor, its z axis turned to +y."""
    upright = mi.ScalarTransform4f().translate([0, 1, 0]).rotate([1, 0, 0], -90.0)
    return {"type": "sphere", "to_world": upright, "bsdf": bsdf}


def check_name(what: str, name: str, known: Sequence[str]) -> None:
    """Raise NacreError if a name is not one of those known."""
    if name not in known:
        hint = did_you_mean(name, known, f"choose one of {', '.join(known)}")
        raise NacreError(f"no {what} {name!r}{hint}")


def camera(
    origin: Sequence[float],
    target: Sequence[float],
    fov: float,
    size: tuple[int, int],
    fov_axis: str = "x",
) -> dict[str, Any]:
    """A perspective camera whose film holds linear colors, with a size in pixels; +y is up.

    The angle of view is in degrees, along the axis that Mitsuba calls "x", "y", "smaller", ...
    """
    width, height = size
    return {
        "type": "perspective",
        "fov": fov,
        "fov_axis": fov_axis,
        "to_world": mitsuba().ScalarTransform4f().look_at(list(origin), list(target), [0, 1, 0]),
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "gaussian"},
        },
        "sampler": {"type": "independent"},
    }


def matte(*reflectance: float) -> dict[str, Any]:
    """A Lambertian surface seen from both sides, with linear RGB or one value for all channels."""
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(*reflectance)}}


def directional(toward: Sequence[float]) -> dict[str, Any]:
    """Light from a direction, with irradiance pi."""
    return {
        "type": "directional",
        "direction": [-x for x in toward],
        "irradiance": rgb(math.pi),
    }


def emitter(mi: Any, light: str, environment: Environment | None) -> dict[str, Any]:
    """The light of a scene by its name; an environment is exposed here."""
    if light == "directional":
        return directional(DirectionalLight.direction)
    exposed = (studio() if environment is None else environment).exposed(EXPOSURE)
    return {"type": "envmap", "bitmap": mi.Bitmap(exposed.pixels)}


def _ball(mi: Any, bsdf: Any) -> dict[str, Any]:
    """A ball with a groove around its tilted axis, held by a dark ring."""
    theta, radius = ball_profile()
    profile = np.stack([radius * np.sin(theta), radius * np.cos(theta)], axis=-1)
    tilt, pan = _BALL_TILT
    place = mi.ScalarTransform4f().translate([0.0, 1.12, 0.0])
    place = place.rotate([0, 1, 0], pan).rotate([1, 0, 0], tilt)
    angle = np.linspace(0.0, 2.0 * math.pi, 97)
    ring = np.stack([0.62 + 0.13 * np.cos(angle), 0.13 + 0.13 * np.sin(angle)], axis=-1)
    stand = {"type": "principled", "base_color": rgb(0.035), "roughness": 0.35, "specular": 0.5}
    return {
        "ball": revolve(mi, "ball", profile, bsdf, place),
        "stand": revolve(mi, "stand", ring[::-1], stand),
    }


def ball_profile() -> tuple[Floats, Floats]:
    """Polar angles from the ball's axis and the radii there, dense where the surface bends."""
    fine = (np.array(_GROOVE)[:, None] + np.linspace(-2.0, 2.0, 41) * _GROOVE_EDGE).ravel()
    theta = np.unique(np.concatenate([np.linspace(0.0, math.pi, 181), fine]))
    opened = _step((theta - _GROOVE[0]) / _GROOVE_EDGE) - _step((theta - _GROOVE[1]) / _GROOVE_EDGE)
    return theta, 1.0 - _GROOVE_DEPTH * opened


def _step(x: Floats) -> Floats:
    """From 0 at -1 to 1 at 1, with two continuous derivatives."""
    t = np.clip(0.5 * x + 0.5, 0.0, 1.0)
    return np.asarray(t * t * t * (t * (6.0 * t - 15.0) + 10.0))


def floor(mi: Any) -> Any:
    """A floor that bends up into a wall; its checks fade away from the object."""
    bend = np.linspace(0.0, 0.5 * math.pi, 48)
    z = np.concatenate([[_FLOOR_FRONT], -_FLOOR_BACK - _FLOOR_BEND * np.sin(bend)])
    y = np.concatenate([[0.0], _FLOOR_BEND * (1.0 - np.cos(bend))])
    z, y = np.append(z, z[-1]), np.append(y, y[-1] + 4.0)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(z), np.diff(y)))])
    sides = np.array([-0.5, 0.5]) * _FLOOR_WIDTH
    positions = np.stack(np.broadcast_arrays(sides, y[:, None], z[:, None]), axis=-1)
    uv = np.stack(np.broadcast_arrays([0.0, 1.0], length[:, None] / length[-1]), axis=-1)

    height = int(_FLOOR_TEXELS * length[-1] / _FLOOR_WIDTH)
    x = ((np.arange(_FLOOR_TEXELS) + 0.5) / _FLOOR_TEXELS - 0.5) * _FLOOR_WIDTH
    ahead = _FLOOR_FRONT - ((np.arange(height) + 0.5) / height * length[-1])[:, None]
    checks = np.sign(np.sin(x * math.pi / _CHECK) * np.sin(ahead * math.pi / _CHECK))
    fade = np.exp(-(x * x + ahead * ahead) / (2.0 * _CHECK_FADE**2))
    texture = (_FLOOR_GRAY + _CHECK_CONTRAST * checks * fade)[..., None].astype(np.float32)
    bitmap = {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(texture)}
    bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": bitmap}}
    return grid_mesh(mi, "floor", positions, uv, bsdf)
