"""The environment that the package includes: a photographer's studio under an open sky.

It is computed from formulas at run time, so there is no image to ship or to license.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.mitsuba.environment import Environment, balanced, pixel_directions

HEIGHT = 256
"""Rows of the package's environments, which are twice as wide."""


_ZENITH = (0.17, 0.26, 0.42)
_HORIZON = (0.66, 0.70, 0.75)
_GLOW = (0.42, 0.34, 0.24)
_GROUND = (0.11, 0.10, 0.09)

_SUN = (-0.50, 0.62, 0.60)
_SUN_RADIUS = math.radians(2.0)
_SUN_RADIANCE = (330.0, 285.0, 225.0)


@dataclass(frozen=True)
class SoftBox:
    """A rectangular lamp with soft edges, seen from the origin.

    Angles are in degrees: azimuth (0 is +z, 90 is +x) and elevation of its center, the width and
    height that it subtends, and its tilt about the center. The radiance in its middle is linear
    RGB.
    """

    azimuth: float
    elevation: float
    width: float
    height: float
    tilt: float
    radiance: tuple[float, float, float]

    def coverage(self, directions: Floats) -> Floats:
        """1 in the middle, 0 outside, smooth between; shape (..., 1)."""
        phi, theta = math.radians(self.azimuth), math.radians(self.elevation)
        center = np.array(
            [math.sin(phi) * math.cos(theta), math.sin(theta), math.cos(phi) * math.cos(theta)]
        )
        right = np.array([math.cos(phi), 0.0, -math.sin(phi)])
        up = np.cross(center, right)
        tilt = math.radians(self.tilt)
        cosine, sine = math.cos(tilt), math.sin(tilt)
        axes = cosine * right + sine * up, cosine * up - sine * right
        depth = directions @ center
        inside = np.ones(directions.shape[:-1])
        for axis, angle in zip(axes, (self.width, self.height), strict=True):
            half = math.tan(math.radians(angle) / 2.0)
            offset = np.abs(directions @ axis) / np.maximum(depth, 1e-6)
            inside *= 1.0 - smoothstep(half - _EDGE, half + _EDGE, offset)
        return np.where(depth > 0.0, inside, 0.0)[..., None]


_EDGE = math.radians(1.5)

_BOXES = (
    # The main lamp: large, slightly warm, high on the right.
    SoftBox(48.0, 34.0, 34.0, 42.0, -8.0, (5.6, 5.3, 4.9)),
    # A long strip, slightly cool, upright on the left: shows the width of a highlight.
    SoftBox(-68.0, 14.0, 7.0, 74.0, 6.0, (6.6, 7.0, 7.6)),
    # A rim lamp behind, above the horizon: lights the edges, which reflect at grazing angles.
    SoftBox(158.0, 30.0, 46.0, 16.0, 0.0, (3.6, 3.6, 3.7)),
)


def smoothstep(low: float, high: float, x: Floats) -> Floats:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def mix(a: npt.ArrayLike, b: npt.ArrayLike, t: Floats) -> Floats:
    return np.asarray(np.asarray(a) * (1.0 - t) + np.asarray(b) * t)


@functools.cache
def studio(rows: int = HEIGHT) -> Environment:
    """The procedural environment, by default 512 x 256: exposed, and neutral.

    Its parts, as seen by a viewer who looks along -z with the lamps behind:

    - a sky from blue at the zenith to near white at the horizon, with a warm glow below the sun;
    - a darker ground, lighter toward the horizon;
    - a small warm sun (radius 2 degrees, soft edge) behind the viewer's left shoulder;
    - a large soft box high on the right, an upright strip on the left, and a rim lamp far behind.

    Colors are balanced so that a white Lambertian sphere seen from +z is white on average.
    """
    directions, _ = pixel_directions(rows, 2 * rows)
    height = directions[..., 1:2]
    sun = np.asarray(_SUN) / np.linalg.norm(_SUN)
    toward_sun = directions @ sun

    sky = mix(_HORIZON, _ZENITH, np.clip(height, 0.0, 1.0) ** 0.55)
    glow = np.exp(4.0 * (toward_sun[..., None] - 1.0)) * np.exp(-3.0 * np.abs(height))
    sky = sky + glow * np.asarray(_GLOW)
    ground = mix(np.asarray(_HORIZON) * 0.42, _GROUND, np.clip(-height, 0.0, 1.0) ** 0.4)
    pixels = mix(ground, sky, smoothstep(-0.012, 0.012, height))

    for box in _BOXES:
        pixels = mix(pixels, box.radiance, box.coverage(directions))
    angle = np.arccos(np.clip(toward_sun, -1.0, 1.0))
    disk = 1.0 - smoothstep(0.7 * _SUN_RADIUS, 1.3 * _SUN_RADIUS, angle)
    pixels = pixels + disk[..., None] * np.asarray(_SUN_RADIANCE)

    return balanced("studio", pixels)
