"""Four plates that mirror four lamps, after Veach's scene for ways to sample.

Every plate is tilted so that the viewer sees the row of lamps reflected in its middle. The lamps
give the same power from spheres of different size: a broad lobe finds the large one, a sharp lobe
the small one.

Veach 1997, "Robust Monte Carlo Methods for Light Transport Simulation", figure 9.2; places and
sizes here are our own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.mesh import grid_mesh
from nacre.mitsuba.scene import camera, matte, path_traced, rgb
from nacre_lab.reproduce.kitchen import sphere

_CAMERA = (0.0, 2.0, 15.0)
_TARGET = (0.0, -1.55, 2.5)
_LAMPS = ((-3.6, 0.05), (-1.2, 0.15), (1.2, 0.4), (3.6, 0.9))
"""Sideways place and radius."""
_POWER = 1.6
_CENTERS = ((-2.5, -0.2), (-3.1, 0.95), (-3.55, 2.25), (-3.85, 3.7))
"""Height and depth of the plates' middles."""
_WIDTH, _DEPTH = 8.6, 1.05


def describe_plates(bsdfs: Sequence[Any], size: tuple[int, int] = (480, 320)) -> dict[str, Any]:
    """Scene dictionary for `mitsuba.load_dict`, of a size in pixels.

    BSDFs or dictionaries of them are for the plates from the farthest to the nearest; fewer than
    four are repeated.
    """
    mi = mitsuba()
    scene = path_traced(4, camera(_CAMERA, _TARGET, 40.0, size))
    scene["sky"] = {"type": "constant", "radiance": rgb(0.02)}
    for index, (x, radius) in enumerate(_LAMPS):
        lamp = {"type": "area", "radiance": rgb(_POWER / radius**2)}
        scene[f"lamp_{index}"] = sphere([x, 0.0, 0.0], radius, emitter=lamp)
    for index, (y, z) in enumerate(_CENTERS):
        scene[f"plate_{index}"] = _plate(mi, index, y, z, bsdfs[index % len(bsdfs)])
    near, far = ([[x, -4.4, z] for x in (-30.0, 30.0)] for z in (12.0, -12.0))
    scene["floor"] = _quad(mi, "floor", near, far, matte(0.25))
    return scene


def _plate(mi: Any, index: int, y: float, z: float, bsdf: Any) -> Any:
    middle = np.array([0.0, y, z])
    ways = [np.asarray(point) - middle for point in (_CAMERA, (0.0, 0.0, 0.0))]
    normal = sum(way / np.linalg.norm(way) for way in ways)
    normal /= np.linalg.norm(normal)
    forward = 0.5 * _DEPTH * np.cross([1.0, 0.0, 0.0], normal)  # away from the viewer and upward
    forward *= -np.sign(forward[2]) if forward[2] else 1.0
    side = np.array([0.5 * _WIDTH, 0.0, 0.0])
    near, far = middle - forward, middle + forward
    return _quad(mi, f"plate_{index}", [near - side, near + side], [far - side, far + side], bsdf)


def _quad(mi: Any, name: str, near: Any, far: Any, bsdf: Any) -> Any:
    """A rectangle that is seen from above: its nearer and its farther edge, left to right."""
    uv = np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]])
    return grid_mesh(mi, name, np.array([far, near], np.float64), uv, bsdf)
