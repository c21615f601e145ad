"""The deterministic sphere: the picture on which reflectances are compared.

Protocol: an orthographic view along -z of a unit sphere, 128 x 128 pixels, one ray through the
center of each. Two lights: an environment, exposed so that a white Lambertian sphere has mean
luminance 0.8 (:meth:`nacre.mitsuba.environment.Environment.exposed`), as 512 fixed directions at
each pixel; and a directional light from the upper left, 45 degrees from the view, with irradiance
pi. There are no shadows and no interreflection, and nothing is random: two reflectances see exactly
the same pairs of directions (:mod:`nacre.mitsuba.lights`). For metrics, values are clipped to
[0, 1] and get a gamma of 2.2 (:func:`nacre.color.tone_map`).

Pictures for people have smooth edges: :func:`smooth_edges` evaluates more points where the rim or
the edge of a shadow runs through a pixel. Metrics never see this.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, Image
from nacre.brdf import Brdf
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import DIRECTIONS, DirectionalLight, EnvironmentLight, Light
from nacre.mitsuba.studio import studio
from nacre.runtime.parallel import thread_map

SIZE = 128
"""Pixels along an edge of the picture."""

MARGIN = 0.03
"""Fraction of the half frame that stays empty around the sphere."""

_PAIRS = 1 << 16  # pairs of directions that a thread holds: about 10 MB with what `eval` needs

Mask = npt.NDArray[np.bool_]
Progress = Callable[[float], None]
"""Called with the finished fraction, in (0, 1], in the caller's thread."""


def standard_lights(
    environment: Environment | None = None, count: int = DIRECTIONS
) -> dict[str, Light]:
    """The two lights of the protocol by name: "environment" and "directional".

    The map is exposed here and sampled in `count` directions; by default it is the package's own
    (:func:`nacre.mitsuba.studio.studio`).
    """
    exposed = (studio() if environment is None else environment).exposed()
    lights: tuple[Light, ...] = (EnvironmentLight(exposed, count), DirectionalLight())
    return {light.name: light for light in lights}


def sphere_normals(size: int = SIZE, offset: Floats | None = None) -> tuple[Floats, Mask]:
    """Normals of the sphere at pixel centers, shifted by `offset` (x, y) pixels, and what it
    covers.

    Normals are unit vectors, shape (size, size, 3), float32: row 0 is the top, +y is up, +x is
    right, +z points to the viewer. They are zero outside the sphere.
    """
    across, down = (0.0, 0.0) if offset is None else offset
    columns, rows = (
        ((np.arange(size) + 0.5 + shift) * 2.0 / size - 1.0) / (1.0 - MARGIN)
        for shift in (across, down)
    )
    x, y = np.meshgrid(columns, -rows)
    squared = 1.0 - x * x - y * y
    mask = squared > 0.0
    z = np.sqrt(np.maximum(squared, 0.0))
    normals = np.where(mask[..., None], np.stack([x, y, z], axis=-1), 0.0)
    return normals.astype(np.float32), mask


def frames(normals: Floats) -> Floats:
    """Rotations from the common frame to the local frames of normals.

    The normals are unit vectors, shape (n, 3), none along y. The result has shape (n, 3, 3), with
    rows tangent, bitangent and normal: `frame @ vector` is local. The tangent runs east along
    circles of latitude about +y, as on a lathe, and the bitangent north. Mitsuba's `sphere` has
    this frame after its z axis is rotated to +y.
    """
    x, _, z = normals.T
    tangent = np.stack([z, np.zeros_like(x), -x], axis=-1) / np.hypot(x, z)[:, None]
    return np.stack([tangent, np.cross(normals, tangent), normals], axis=1)


def render_sphere(
    brdf: Brdf, light: Light, size: int = SIZE, progress: Progress | None = None
) -> tuple[Image, Mask]:
    """Picture of a sphere with one material.

    Parameters
    ----------
    brdf
        Any reflectance; evaluated through :meth:`nacre.brdf.Brdf.eval`, in one thread per core.
    light
        One of :func:`standard_lights`, or another.
    size
        Pixels along an edge.
    progress
        Called as the picture grows.

    Returns
    -------
    image
        Linear RGB, shape (size, size, 3), float32; 0 outside the sphere.
    mask
        Which pixels the sphere covers, shape (size, size).
    """
    normals, mask = sphere_normals(size)
    image = np.zeros((size, size, 3), np.float32)
    image[mask] = _shade_all(brdf, light, frames(normals[mask]), progress)
    return image, mask


def smooth_edges(image: Image, brdf: Brdf, light: Light) -> tuple[Image, npt.NDArray[np.float32]]:
    """A picture from :func:`render_sphere` with smooth edges, for people to look at.

    Pixels on the rim show the mean over 4 x 4 points inside them. If the light has a
    single direction, so that its shadow has an edge, all pixels do.

    Returns
    -------
    image
        Linear RGB, black outside the sphere, shape (size, size, 3).
    coverage
        Fraction of each pixel that the sphere covers, shape (size, size).
    """
    size = len(image)
    shifts = (np.arange(4) + 0.5) / 4 - 0.5
    grid = [sphere_normals(size, np.array([x, y])) for y in shifts for x in shifts]
    masks = np.stack([mask for _, mask in grid])
    coverage: npt.NDArray[np.float32] = masks.mean(axis=0, dtype=np.float32)
    rendered: Mask = np.asarray(coverage > 0.0)
    if light.count > 1:
        rendered &= coverage < 1.0
    smooth: Image = np.where(rendered[..., None], np.float32(0.0), image)
    for normals, mask in grid:
        chosen = mask & rendered
        shaded = _shade_all(brdf, light, frames(normals[chosen]))
        smooth[chosen] += np.asarray(shaded / len(grid), np.float32)
    return smooth, coverage


def _shade_all(brdf: Brdf, light: Light, local: Floats, progress: Progress | None = None) -> Floats:
    """Radiance toward +z at points with given frames, in one thread per core, shape (n, 3)."""
    step = max(1, _PAIRS // light.count)
    parts = [local[start : start + step] for start in range(0, len(local), step)]
    shaded = []
    for radiance in thread_map(lambda part: _shade(brdf, part, light), parts):
        shaded.append(radiance)
        if progress is not None:
            progress(len(shaded) / len(parts))
    return np.concatenate(shaded) if shaded else np.zeros((0, 3))


def _shade(brdf: Brdf, local: Floats, light: Light) -> Floats:
    """Radiance toward +z at points with given frames, shape (n, 3)."""
    wi, weights, points = light.incident(local)
    reflected = brdf.eval(wi, local[:, :, 2][points]) * (wi[:, 2:] * weights)
    return np.stack(
        [np.bincount(points, channel, minlength=len(local)) for channel in reflected.T], axis=-1
    )
