"""Views of a material under lights, as pictures of it show them, for fits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats, Weights
from nacre.geometry import join, rotate, split, to_spherical, uniform_hemisphere
from nacre.sampling.moment import propose_lights

SHARPNESS, LAMPS = (1.0, 2000.0), 12
"""Range of sharpness, from half of the sky to a small bulb, and number of the lamps that fits to
pictures mix to a light.

Without small ones, a lobe may become a mirror unpunished."""

_SPREAD = 0.4  # of the lamps about the mirror direction


@dataclass(frozen=True)
class LitViews:
    """Views, each under some lights, and directions for the integrals over these.

    Directions to the light and to the viewer are of shape (v, n, 3), `wo` the same along n up to
    its azimuth; weights of f_r, shape (v, lights, n), are radiance times cos(theta_i) over the
    density of the directions.
    """

    wi: Weights
    wo: Weights
    weights: Weights

    def radiance(self, f_r: Floats) -> Floats:
        """What the views see, shape (..., v, lights, 3), for f_r of shape (..., v, n, 3)."""
        return np.asarray(self.weights @ f_r)


def lit_views(
    seed: int,
    views: int | Sequence[float] = 16,
    directions: int = 128,
    lights: int = 4,
    sharpness: tuple[float, float] = (3.0, 60.0),
    lamps: int = 1,
    isotropic: bool = True,
) -> LitViews:
    """Views as a picture of a sphere shows them, under an even sky and under lamps of many sizes.

    `views` are how many, evenly over the picture of a sphere, or the squared sines of their polar
    angles; they may all have azimuth 0 if `isotropic`, else each has one for all of its directions.
    Each has so many directions and lights, of which the first is the sky, with radiance 1, so that
    the albedo is seen. Lamps are von Mises-Fisher lobes with the sky's irradiance, from one
    `sharpness` to the other (3 is a third of the sky, 60 a bulb near by); those of every other
    light are near the mirror direction. Several `lamps` per light are mixed with each other and the
    sky at random. The same seed gives the same ones.
    """
    if isinstance(views, int):  # a sphere shows all of them alike
        views = ((np.arange(views) + 0.5) / views).tolist()
    squared_sines = np.asarray(views)
    views = len(squared_sines)
    wo, wi, density = propose_lights(squared_sines, directions, seed)
    azimuth = to_spherical(split(wo))[1]
    random = np.random.default_rng((seed, 6))
    above = join(uniform_hemisphere(*random.random((2, views, lights, lamps))))
    if not isotropic:
        azimuth -= np.random.default_rng((seed, 7)).uniform(0.0, 2.0 * math.pi, (views, 1))
    wo, wi = (join(rotate(split(w), -azimuth)) for w in (wo, wi))
    mirror = wo[:, None, :1] * (-1.0, -1.0, 1.0)
    near = mirror + random.normal(0.0, _SPREAD, above.shape)
    near /= np.linalg.norm(near, axis=-1, keepdims=True)
    centers = np.where(np.arange(lights)[:, None, None] % 2, above, near)
    low, high = np.log(sharpness)
    sharp = np.exp(random.uniform(low, high, (views, lights, lamps, 1)))
    lobes = 0.5 * sharp * np.exp(sharp * (centers @ wi[:, None].swapaxes(2, 3) - 1.0))
    if lamps > 1:
        parts = random.dirichlet(np.ones(lamps + 1), (views, lights))
        radiance = parts[..., :1] + np.einsum("vlk,vlkn->vln", parts[..., 1:], lobes)
    else:
        radiance = lobes[:, :, 0]
    radiance[:, 0] = 1.0
    weights = radiance * (wi[..., 2] / density)[:, None] / directions
    return LitViews(*(array.astype(np.float32) for array in (wi, wo, weights)))


def lit_spheres(
    angles: Sequence[float], size: int, isotropic: bool = True
) -> tuple[Weights, Weights]:
    """Pairs of directions (wi, wo), shapes (n, 3), in pictures of a sphere, each under one
    directional light, where that reaches the sphere, in the frames of
    :func:`nacre.mitsuba.sphere.frames`.

    `angles` are those between light and view in degrees, one per picture, and `size` the pixels
    along its edge. For an isotropic material, only the half above the plane of light and view is
    taken; for others, lights come from as many azimuths.
    """
    nodes = (np.arange(size) + 0.5) * 2.0 / size - 1.0
    x, y = (grid.reshape(-1) for grid in np.meshgrid(nodes, nodes))
    kept = x * x + y * y < 1.0
    if isotropic:
        kept &= y > 0.0
    n = np.stack([x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))], axis=-1)[kept]
    east = np.stack([n[:, 2], np.zeros(len(n)), -n[:, 0]], axis=-1)
    east /= np.linalg.norm(east, axis=-1, keepdims=True)
    frame = np.stack([east, np.cross(n, east), n], axis=1)
    pairs = []
    for k, angle in enumerate(np.radians(angles)):
        azimuth = 0.0 if isotropic else 2.0 * math.pi * k / len(angles)
        sine = math.sin(angle)
        light = (sine * math.cos(azimuth), sine * math.sin(azimuth), math.cos(angle))
        wi, wo = frame @ np.array(light), frame[:, :, 2]
        lit = wi[:, 2] > 0.0
        pairs.append(np.stack([wi[lit], wo[lit]]))
    wi, wo = np.concatenate(pairs, axis=1).astype(np.float32)
    return wi, wo
