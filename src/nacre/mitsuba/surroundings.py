"""The package's other environments, each computed from formulas at run time.

Maps are exposed, and 512 x 256 unless another number of rows is asked for. A camera's full white
balance would take the warmth from an evening: colors are balanced halfway where people expect
colored light, and fully elsewhere.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.mitsuba.environment import Environment, balanced, pixel_directions
from nacre.mitsuba.studio import HEIGHT, mix, smoothstep, studio


def _waves(x: Floats, y: Floats, octaves: int, turn: float) -> Floats:
    """A sum of waves in all directions over a plane, about -1 to 1: clouds without a table.

    Each octave bends the coordinates of the next (domain warping); otherwise rows of waves would
    show.
    """
    total, size = np.zeros(x.shape), 1.0
    for k in range(octaves):
        c, s = math.cos(turn + 2.4 * k), math.sin(turn + 2.4 * k)
        u, v = c * x - s * y, s * x + c * y
        wave = np.sin(u + 1.7 * k) * np.cos(v - 0.9 * k)
        total += size * wave
        x, y, size = 1.9 * x + 0.8 * wave, 1.9 * y - 0.8 * wave, 0.55 * size
    return np.asarray(total * 0.6)


def _hills(directions: Floats, low: float, high: float) -> Floats:
    """1 below a distant line of trees between two elevations in radians, shape (h, w, 1)."""
    phi = np.arctan2(directions[..., 0], directions[..., 2])
    line = np.sin(2.0 * phi + 0.6) + 0.6 * np.sin(5.0 * phi) + 0.3 * np.sin(13.0 * phi + 2.0)
    line += 0.15 * np.sin(31.0 * phi) + 0.1 * np.sin(47.0 * phi + 1.0)
    edge = low + (high - low) * (0.5 + line / 4.3)
    elevation = np.arcsin(np.clip(directions[..., 1], -1.0, 1.0))
    return 1.0 - smoothstep(-0.008, 0.008, elevation - edge)[..., None]


def _overhead(directions: Floats) -> tuple[Floats, Floats]:
    """Where directions above the horizon meet a layer of clouds, which curves down far away."""
    height = np.maximum(directions[..., 1], 0.0) + 0.12
    return directions[..., 0] / height, directions[..., 2] / height


@functools.cache
def overcast(rows: int = HEIGHT) -> Environment:
    """A field under a closed layer of clouds: soft light from above, no shadows, neutral.

    The sky is the CIE standard overcast sky (ISO 15469:2004, type 1), three times as bright at the
    zenith as at the horizon, with faint clouds; the ground reflects a fifth of its light.
    """
    directions, _ = pixel_directions(rows, 2 * rows)
    height = directions[..., 1:2]
    x, z = _overhead(directions)
    clouds = _waves(2.2 * x, 2.2 * z, 5, 0.4)[..., None]
    sky = (1.0 + 2.0 * np.maximum(height, 0.0)) / 3.0 * (1.0 + 0.22 * clouds)
    sky = sky * mix((0.96, 0.99, 1.03), (1.03, 1.0, 0.95), np.clip(0.5 + clouds, 0.0, 1.0))
    # The irradiance from that sky is 7 pi / 9 times the zenith's radiance.
    ground = 0.2 * 7.0 / 9.0 * mix((1.15, 1.05, 0.85), (0.95, 1.0, 0.75), -np.minimum(height, 0.0))
    pixels = mix(ground, sky, smoothstep(-0.012, 0.012, height))
    trees = 0.055 * np.array([0.85, 1.0, 0.8])
    pixels = mix(pixels, trees, _hills(directions, 0.01, 0.12) * (height > -0.012))
    return balanced("overcast", pixels)


_LATE_SUN = (-0.72, 0.16, 0.55)
_LATE_RADIUS = math.radians(2.2)


@functools.cache
def late_sun(rows: int = HEIGHT) -> Environment:
    """Open country with the sun low on the viewer's left: warm light, a sky that turns blue.

    The sun stands 10 degrees high, with a soft edge at a radius of 2.2 degrees, and gives half as
    much light as the sky. The sky is orange near it, pink opposite and blue overhead, with low
    bands of cloud.
    """
    directions, _ = pixel_directions(rows, 2 * rows)
    height = directions[..., 1:2]
    up = np.clip(height, 0.0, 1.0)
    sun = np.asarray(_LATE_SUN) / np.linalg.norm(_LATE_SUN)
    cosine = directions @ sun
    near = (0.5 + 0.5 * cosine)[..., None]
    horizon = mix((0.42, 0.34, 0.42), (1.3, 0.62, 0.22), near**3)
    sky = mix(horizon, (0.10, 0.20, 0.46), up**0.45)
    sky = sky + np.exp(16.0 * (cosine[..., None] - 1.0)) * np.array([1.7, 0.8, 0.25])

    x, z = _overhead(directions)
    bands = _waves(0.8 * x + 0.3 * z, 2.6 * z - 0.9 * x, 5, 0.2)[..., None]
    cover = smoothstep(0.05, 0.55, bands) * smoothstep(0.02, 0.1, up) * (1.0 - up) ** 1.5
    lit = mix((0.36, 0.27, 0.34), (2.0, 0.95, 0.42), near**3)
    sky = mix(sky, lit, 0.75 * cover)
    disk = 1.0 - smoothstep(
        0.7 * _LATE_RADIUS, 1.3 * _LATE_RADIUS, np.arccos(np.clip(cosine, -1.0, 1.0))
    )
    sky = sky + disk[..., None] * np.array([400.0, 225.0, 90.0])

    ground = mix((0.30, 0.22, 0.12), (0.10, 0.09, 0.06), np.clip(-height, 0.0, 1.0) ** 0.35)
    pixels = mix(ground, sky, smoothstep(-0.012, 0.012, height))
    hills = _hills(directions, 0.005, 0.06) * (height > -0.012)
    pixels = mix(pixels, mix((0.05, 0.05, 0.08), (0.16, 0.09, 0.05), near**2), hills)
    return balanced("late sun", pixels, 0.5)


_ROOM = np.array([-2.2, -1.1, -3.0]), np.array([2.6, 1.6, 3.2])
"""Corners of the room, in meters from the materials, which stand on a table."""
_WINDOW = (-0.45, 1.15), (-0.9, 1.5)  # heights and depths between which the left wall is open
_FRAME = 0.035
_LAMPS = (
    # A globe in the right corner, and one that hangs behind the viewer.
    ((1.7, 0.45, 1.5), 0.17, (62.0, 42.0, 22.0)),
    ((-0.3, 1.1, 2.4), 0.13, (50.0, 36.0, 20.0)),
)
_WALLS = ((0.62, 0.58, 0.52), (0.50, 0.56, 0.60), (0.60, 0.57, 0.52))
"""Colors of the left and right walls, floor and ceiling, and the walls ahead and behind."""
_FLOOR, _CEILING = (0.30, 0.19, 0.11), (0.78, 0.77, 0.74)
_DAY = np.array([8.5, 9.6, 11.0])
_BOUNCED = 0.11  # light on the walls from other walls, as a radiance on white


@functools.cache
def room(rows: int = HEIGHT) -> Environment:
    """A living room: daylight through a window on the left, two warm lamps, a wooden floor.

    The window and the lamps light the walls (Lambert's law, without shadows); light between walls
    is a constant.
    """
    directions, _ = pixel_directions(rows, 2 * rows)
    low, high = _ROOM
    directions = np.where(np.abs(directions) < 1e-6, 1e-6, directions)
    reach = np.where(directions > 0.0, high, low) / directions
    axis = np.argmin(reach, axis=-1)[..., None]
    points = directions * np.take_along_axis(reach, axis, -1)
    ahead = np.take_along_axis(directions, axis, -1) > 0.0
    normals = np.where(np.arange(3) == axis, np.where(ahead, -1.0, 1.0), 0.0)

    white = np.select([axis == k for k in range(3)], [np.array(wall) for wall in _WALLS])
    boards = 1.0 + 0.15 * np.sin(14.0 * points[..., :1]) * np.sin(2.3 * points[..., 2:] + 5.0)
    white = np.where((axis == 1) & ~ahead, np.array(_FLOOR) * boards, white)
    white = np.where((axis == 1) & ahead, np.array(_CEILING), white)
    pixels = white * (_BOUNCED + _lit(points, normals))

    (bottom, top), (near, far) = _WINDOW
    _, y, z = np.moveaxis(points, -1, 0)
    panes = np.ones(y.shape)
    for at, (first, last), parts in ((y, (bottom, top), 2), (z, (near, far), 3)):
        pane = (last - first) / parts
        place = (at - first) / pane
        edge = (0.5 - np.abs(place - np.floor(place) - 0.5)) * pane
        inside = (place > 0.0) & (place < parts)
        panes *= smoothstep(_FRAME - 0.02, _FRAME + 0.02, edge) * inside
    outside = mix(0.3 * _DAY * (0.9, 1.0, 0.7), _DAY, smoothstep(-0.06, 0.02, directions[..., 1:2]))
    wall = ((axis == 0) & ~ahead)[..., 0]
    pixels = mix(pixels, outside, (panes * wall)[..., None])

    for center, radius, radiance in _LAMPS:
        away = np.linalg.norm(center)
        angle = np.arccos(np.clip(directions @ (np.asarray(center) / away), -1.0, 1.0))
        seen = math.asin(radius / away)
        globe = 1.0 - smoothstep(0.85 * seen, 1.15 * seen, angle)
        pixels = mix(pixels, radiance, globe[..., None])
    return balanced("room", pixels, 0.5)


def _lit(points: Floats, normals: Floats) -> Floats:
    """Irradiance / pi from window and lamps at points with normals, shapes (h, w, 3)."""
    (bottom, top), (near, far) = _WINDOW
    rows, columns = 3, 4
    area = (top - bottom) * (far - near) / (rows * columns)
    total = np.zeros(points.shape)

    def add(source: npt.ArrayLike, light: npt.ArrayLike, window: bool) -> None:
        way = np.asarray(source) - points
        squared = np.sum(way * way, axis=-1, keepdims=True) + 0.05
        cosine = np.maximum(np.sum(way * normals, axis=-1, keepdims=True), 0.0) / np.sqrt(squared)
        if window:  # daylight falls in from above; light from below the horizon is darker
            below = smoothstep(-0.2, 0.3, way[..., 1:2] / np.sqrt(squared))
            cosine = (
                cosine * (0.3 + 0.7 * below) * np.maximum(-way[..., :1], 0.0) / np.sqrt(squared)
            )
        total[...] += np.asarray(light) * cosine / squared

    for row in range(rows):
        for column in range(columns):
            y = bottom + (row + 0.5) / rows * (top - bottom)
            z = near + (column + 0.5) / columns * (far - near)
            add((_ROOM[0][0], y, z), _DAY * area / math.pi, True)
    for center, radius, radiance in _LAMPS:
        add(center, np.asarray(radiance) * radius**2, False)
    return total


ENVIRONMENTS: Mapping[str, Callable[..., Environment]] = {
    "studio": studio,
    "overcast": overcast,
    "late sun": late_sun,
    "room": room,
}
"""The package's environments by name; each is computed when first asked for."""
