"""Directions of light for the points of a picture: the same for every material.

A light gives each point of a surface a fixed set of directions and weights. Under an environment,
half of them follow the light (:func:`quadrature`) and half lie around the mirror direction, in
lobes of three widths; the balance heuristic (Veach and Guibas 1995) combines both. So a mirror
shows its surroundings smoothly, a rough material is lit evenly, and two reflectances are still
compared on exactly the same pairs of directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.color import luminance
from nacre.mitsuba.environment import Environment, pixel_directions, row_edges

Indices = npt.NDArray[np.intp]

DIRECTIONS = 512
"""Directions by which an environment is sampled at one point."""

ROUGHNESS = (0.006, 0.035, 0.2)
"""GGX roughness of the lobes around the mirror direction."""

_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


class Light(Protocol):
    """Directions to the light at points with given frames, seen along the common z axis."""

    name: str
    count: int
    """The most directions that one point has."""

    def incident(self, frames: Floats) -> tuple[Floats, Floats, Indices]:
        """Directions to the light above the horizon of each point, their weights, and their points.

        Frames are rotations from the common to the local frames, shape (n, 3, 3), float32. The
        result is local directions and radiance times solid angle (linear RGB), both of shape (m, 3)
        and float32, and the index of the point that each belongs to, shape (m,).
        """
        ...


class DirectionalLight:
    """Light from the upper left, 45 degrees from the view, with irradiance pi.

    A white Lambertian surface then has radiance cos(theta_i).
    """

    name = "directional"
    count = 1
    direction = (-0.5, 0.5, math.sqrt(0.5))
    """Toward the light; +x is right, +y up, +z toward the viewer."""

    def incident(self, frames: Floats) -> tuple[Floats, Floats, Indices]:
        wi = frames @ np.asarray(self.direction, frames.dtype)
        (points,) = np.nonzero(wi[:, 2] > 0.0)
        return wi[points], np.full((len(points), 3), math.pi, frames.dtype), points


class EnvironmentLight:
    """An environment as a fixed set of directions.

    Parameters
    ----------
    environment
        The map, already exposed.
    count
        Directions at each point, at least 2; half follow the light, half the mirror direction.
    """

    name = "environment"

    def __init__(self, environment: Environment, count: int = DIRECTIONS) -> None:
        if count < 2:
            raise ValueError(f"an environment needs at least two directions, got {count}")
        self.count = count
        self._pixels = environment.pixels
        toward_light = count // 2
        self._directions, self._weights = quadrature(environment, toward_light)
        power = float(luminance(tuple(self._weights.T)).sum())
        self._density = luminance(tuple(np.moveaxis(self._pixels, -1, 0))) * (toward_light / power)
        self._near_light = self._density[environment.pixel(self._directions)]
        mirrored = range(toward_light, count)
        self._per_lobe = [len(mirrored[k :: len(ROUGHNESS)]) for k in range(len(ROUGHNESS))]
        self._half_vectors = _lobe_half_vectors(self._per_lobe)
        self._pixel = environment.pixel

    def incident(self, frames: Floats) -> tuple[Floats, Floats, Indices]:
        wo = frames[:, :, 2]
        points, light = np.nonzero(frames[:, 2] @ self._directions.T > 0.0)
        wi = np.einsum("nij,nj->ni", frames[points], self._directions[light])
        near = self._near_light[light]
        balance = near / (near + self._near_mirror(wi, wo[points]))
        weights = self._weights[light] * balance[:, None]

        cosine = wo @ self._half_vectors.T
        above = (cosine > 0.0) & (2.0 * cosine * self._half_vectors[:, 2] > wo[:, 2:])
        mirrored, lobe = np.nonzero(above)
        h, w = self._half_vectors[lobe], wo[mirrored]
        wi_mirrored = 2.0 * cosine[above][:, None] * h - w
        pixel = self._pixel(np.einsum("nij,ni->nj", frames[mirrored], wi_mirrored))
        density = self._density[pixel] + self._near_mirror(wi_mirrored, w)
        weights_mirrored = self._pixels[pixel] / density[:, None]
        return (
            np.concatenate([wi, wi_mirrored]),
            np.concatenate([weights, weights_mirrored]),
            np.concatenate([points, mirrored]),
        )

    def _near_mirror(self, wi: Floats, wo: Floats) -> Floats:
        """Density, per sr at `wi`, of the directions that follow the mirror direction."""
        h = wi + wo
        squared = np.einsum("ij,ij->i", h, h)
        along, aside = h[:, 2] ** 2 / squared, (h[:, 0] ** 2 + h[:, 1] ** 2) / squared
        lobes = sum(
            np.float32(n * a * a) / (np.float32(a * a) * along + aside) ** 2
            for n, a in zip(self._per_lobe, ROUGHNESS, strict=True)
        )
        # The density of h is D cos(theta_h); divide by 4 wo.h for wi, and wo.h = |wi + wo| / 2.
        return np.asarray(lobes * h[:, 2] / (2.0 * math.pi * squared))


def _lobe_half_vectors(counts: Sequence[int]) -> Floats:
    parts = []
    for count, roughness in zip(counts, ROUGHNESS, strict=True):
        u, v = golden_lattice(count)
        tangent = roughness * np.sqrt(u / (1.0 - u))
        cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
        phi = 2.0 * math.pi * v
        sine = tangent * cosine
        parts.append(np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1))
    return np.concatenate(parts).astype(np.float32)


def golden_lattice(count: int) -> tuple[Floats, Floats]:
    """Evenly spread points in the unit square: a rank-1 lattice with the golden ratio.

    These are (k + 1/2) / count and frac((k + 1/2) / golden ratio), in [0, 1), shapes (count,).
    """
    index = np.arange(count) + 0.5
    return index / max(count, 1), np.modf(index * _GOLDEN)[0]


def quadrature(environment: Environment, count: int) -> tuple[Floats, Floats]:
    """Light directions and weights whose sums stand for integrals over the environment.

    For any function f of direction, the integral of f times radiance over the sphere is about
    `(f(directions) * weights).sum(0)`. Directions are distributed in proportion to luminance, by
    inverting its cumulative distribution over the pixels at :func:`golden_lattice`, so the same map
    and count always give the same directions. The map is taken as constant within a pixel, so all
    weights have the same luminance.

    Returns unit vectors toward the light and radiance times solid angle in linear RGB, both of
    shape (count, 3) and float32. The count is at least 1.
    """
    if count < 1:
        raise ValueError(f"a quadrature needs at least one direction, got {count}")
    pixels = environment.pixels.astype(np.float64)
    height, width, _ = pixels.shape
    _, solid_angles = pixel_directions(height, width)
    value = luminance(tuple(np.moveaxis(pixels, -1, 0)))
    power = value * solid_angles[:, None]
    u, v = golden_lattice(count)

    row, down = _invert(np.cumsum(power.sum(axis=1)), u)
    columns = np.cumsum(power, axis=1)
    column, across = np.empty(count, int), np.empty(count)
    for j in np.unique(row):
        chosen = row == j
        column[chosen], across[chosen] = _invert(columns[j], v[chosen])

    edges = row_edges(height)
    y = edges[row] + down * (edges[row + 1] - edges[row])
    radius, phi = np.sqrt(1.0 - y * y), (column + across) * (2.0 * math.pi / width)
    directions = np.stack([radius * np.sin(phi), y, -radius * np.cos(phi)], axis=-1)
    weights = pixels[row, column] / value[row, column, None] * (power.sum() / count)
    return directions.astype(np.float32), weights.astype(np.float32)


def _invert(cumulative: Floats, u: Floats) -> tuple[npt.NDArray[np.int_], Floats]:
    """Bin in which a fraction `u` of the total lies, and where within the bin, in [0, 1)."""
    target = u * cumulative[-1]
    index = np.minimum(np.searchsorted(cumulative, target, side="right"), len(cumulative) - 1)
    start = np.where(index > 0, cumulative[index - 1], 0.0)
    return index, (target - start) / (cumulative[index] - start)
