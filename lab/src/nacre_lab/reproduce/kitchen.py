"""A small kitchen under daylight: twelve materials, lit mostly by each other.

A room with one window. What stands in it comes from boxes, spheres and surfaces of revolution; the
room itself is matte. +y is up, units are metres.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.mesh import revolve
from nacre.mitsuba.scene import camera, matte, path_traced, rgb

SLOTS = (
    *("counter", "doors", "tiles", "hood", "pot", "kettle"),
    *("bowl", "apple", "orange", "bottle", "table", "cup"),
)
"""What can be given a material."""

_WIDTH, _HEIGHT, _BACK, _FRONT = 4.4, 2.6, -1.6, 2.9
_DAYLIGHT = (46.0, 47.0, 52.0)
_STEP = 0.004
"""Distance of points along the outline of a surface of revolution."""

# Boxes by slot: lowest and highest corner.
_BOXES: Mapping[str, Sequence[tuple[Sequence[float], Sequence[float]]]] = {
    "counter": [((-2.0, 0.88, -1.6), (2.0, 0.93, -0.93))],
    "doors": [
        *(((-2.0 + 0.8 * k, 0.1, -1.6), (-1.22 + 0.8 * k, 0.86, -0.98)) for k in range(5)),
        *(((x, 1.62, -1.6), (x + 0.72, 2.32, -1.28)) for x in (-2.0, -1.26, 0.54, 1.28)),
    ],
    "tiles": [
        ((-2.2 + 0.22 * i, 0.95 + 0.22 * j, -1.6), (-1.99 + 0.22 * i, 1.16 + 0.22 * j, -1.585))
        for i in range(20)
        for j in range(3)
    ],
    "hood": [((-0.42, 1.66, -1.6), (0.42, 1.78, -1.05)), ((-0.16, 1.78, -1.6), (0.16, 2.6, -1.3))],
    "table": [
        ((0.05, 0.72, 0.1), (1.45, 0.76, 1.0)),
        *(((x, 0.0, z), (x + 0.06, 0.72, z + 0.06)) for x in (0.1, 1.34) for z in (0.15, 0.9)),
    ],
}
# Outlines by slot, radii and heights from the top of the axis down the outside to its foot, or
# from the middle of a hollow up and over its edge; then where they stand.
_OUTLINES: Mapping[str, tuple[Sequence[tuple[float, float]], Sequence[float]]] = {
    "pot": (
        [(0, 0.3), (0.03, 0.3), (0.035, 0.265), (0.015, 0.25), (0.17, 0.225), (0.19, 0.215),
         (0.19, 0.2), (0.18, 0.19), (0.18, 0.02), (0.16, 0.0), (0.0, 0.0)],
        (0.12, 0.93, -1.22),
    ),
    "kettle": (
        [(0, 0.26), (0.02, 0.26), (0.02, 0.235), (0.05, 0.225), (0.085, 0.19), (0.115, 0.13),
         (0.13, 0.06), (0.125, 0.015), (0.11, 0.0), (0.0, 0.0)],
        (-0.32, 0.93, -1.18),
    ),
    "bowl": (
        [(0, 0.02), (0.08, 0.022), (0.16, 0.06), (0.2, 0.11), (0.21, 0.115), (0.205, 0.1),
         (0.165, 0.045), (0.09, 0.008), (0.08, 0.0), (0.0, 0.0)],
        (0.62, 0.76, 0.5),
    ),
    "bottle": (
        [(0, 0.34), (0.016, 0.34), (0.018, 0.325), (0.014, 0.32), (0.015, 0.24), (0.04, 0.19),
         (0.042, 0.18), (0.042, 0.01), (0.036, 0.0), (0.0, 0.0)],
        (-0.95, 0.93, -1.2),
    ),
    "cup": (
        [(0, 0.012), (0.032, 0.014), (0.038, 0.03), (0.041, 0.1), (0.044, 0.1), (0.042, 0.03),
         (0.034, 0.0), (0.0, 0.0)],
        (0.98, 0.76, 0.42),
    ),
}  # fmt: skip
_BALLS: Mapping[str, Sequence[tuple[Sequence[float], float]]] = {
    "apple": [((0.56, 0.85, 0.5), 0.062), ((0.36, 0.795, 0.66), 0.035)],
    "orange": [((0.69, 0.85, 0.48), 0.058), ((0.63, 0.92, 0.55), 0.05), ((1.35, 0.98, -1.2), 0.05)],
}


def describe_kitchen(bsdfs: Sequence[Any], size: tuple[int, int] = (480, 320)) -> dict[str, Any]:
    """Scene dictionary for `mitsuba.load_dict`, of a size in pixels.

    BSDFs or dictionaries of them are for :data:`SLOTS`, in this order; fewer are repeated.
    """
    mi = mitsuba()
    place = mi.ScalarTransform4f()
    given = {slot: bsdfs[index % len(bsdfs)] for index, slot in enumerate(SLOTS)}
    eye = camera([-0.75, 1.5, 2.75], [0.25, 0.98, -0.9], 52.0, size)
    scene = path_traced(8, eye) | _room(place)
    for slot, boxes in _BOXES.items():
        for index, (low, high) in enumerate(boxes):
            center, half = 0.5 * (np.add(high, low)), 0.5 * np.subtract(high, low)
            at = place.translate(center.tolist()).scale(half.tolist())
            scene[f"{slot}_{index}"] = {"type": "cube", "to_world": at, "bsdf": given[slot]}
    for slot, (outline, where) in _OUTLINES.items():
        at = place.translate(list(where))
        scene[slot] = revolve(mi, slot, _dense(outline), given[slot], at)
    for slot, balls in _BALLS.items():
        for index, (middle, radius) in enumerate(balls):
            scene[f"{slot}_{index}"] = sphere(middle, radius, bsdf=given[slot])
    return scene


def sphere(middle: Sequence[float], radius: float, **surface: Any) -> dict[str, Any]:
    """A sphere with a `bsdf` or an `emitter`."""
    return {"type": "sphere", "center": list(middle), "radius": radius, **surface}


def _room(place: Any) -> dict[str, Any]:
    """Walls that look inwards, and daylight in the window of the left one."""
    depth, middle = 0.5 * (_FRONT - _BACK), 0.5 * (_FRONT + _BACK)
    up, across = 0.5 * _HEIGHT, 0.5 * _WIDTH
    walls = {
        "floor": (place.translate([0, 0, middle]).rotate([1, 0, 0], -90), (across, depth), 0.25),
        "ceiling": (
            place.translate([0, _HEIGHT, middle]).rotate([1, 0, 0], 90), (across, depth), 0.75,
        ),
        "back": (place.translate([0, up, _BACK]), (across, up), 0.6),
        "front": (place.translate([0, up, _FRONT]).rotate([0, 1, 0], 180), (across, up), 0.5),
        "left": (place.translate([-across, up, middle]).rotate([0, 1, 0], 90), (depth, up), 0.6),
        "right": (place.translate([across, up, middle]).rotate([0, 1, 0], -90), (depth, up), 0.55),
    }  # fmt: skip
    room = {
        name: {"type": "rectangle", "to_world": at.scale([*half, 1]), "bsdf": matte(grey)}
        for name, (at, half, grey) in walls.items()
    }
    window = place.translate([0.01 - across, 1.5, 0.35]).rotate([0, 1, 0], 90).scale([0.6, 0.5, 1])
    room["window"] = {
        "type": "rectangle",
        "to_world": window,
        "emitter": {"type": "area", "radiance": rgb(*_DAYLIGHT)},
    }
    return room


def _dense(outline: Sequence[tuple[float, float]]) -> npt.NDArray[np.floating]:
    """Points along an outline, close enough that its corners stay corners."""
    points = np.array(outline, np.float64)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.unique(np.concatenate([np.arange(0.0, length[-1], _STEP), length]))
    return np.stack([np.interp(at, length, points[:, k]) for k in range(2)], axis=-1)
