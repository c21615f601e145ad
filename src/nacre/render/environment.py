"""Light from all around: latitude-longitude maps, their look-up, and a fixed quadrature of them.

Orientation is that of Mitsuba's `envmap` emitter without `to_world`: +y is up, and a viewer who
looks along -z has +x at the right. Column u in [0, 1) and row v in [0, 1] of a map show the
direction with azimuth 2 pi u = atan2(x, -z) and polar angle pi v = acos(y). The middle column is
therefore +z: what lies *behind* a viewer who looks along -z, and what a mirror ball shows at its
centre. Columns are centred at (i + 1/2) / width; rows lie at j / (height - 1), poles included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.color import luminance
from nacre.files import FormatError, PathLike, require

Floats = npt.NDArray[np.floating]

EXPOSURE = 0.8
"""Mean radiance of a white Lambertian sphere under an exposed environment."""

EXTENSIONS = (".exr", ".hdr", ".png")
"""Endings of the files that :func:`load_environment` reads."""

_MAX_PIXELS = 1 << 26
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, eq=False)
class Environment:
    """Radiance from infinitely far away.

    Parameters
    ----------
    pixels
        Latitude-longitude map, shape (height, width, 3), float32, linear Rec. 709 RGB, finite and
        non-negative, not black everywhere; at least 2 x 2.
    name
        Name of the map, for people.
    """

    pixels: npt.NDArray[np.float32]
    name: str = ""

    def __post_init__(self) -> None:
        shape = self.pixels.shape
        if len(shape) != 3 or shape[2] != 3 or min(shape) < 2:
            raise ValueError(f"expected a map of shape (height, width, 3), got {shape}")
        if not np.isfinite(self.pixels).all() or (self.pixels < 0.0).any():
            raise ValueError("radiance must be finite and non-negative")
        if not self.pixels.any():
            raise ValueError("the map is black everywhere")

    def radiance(self, directions: npt.ArrayLike) -> Floats:
        """Radiance that arrives from `directions`, interpolated bilinearly.

        Parameters
        ----------
        directions
            Unit vectors away from the origin, shape (..., 3).

        Returns
        -------
        array of shape (..., 3)
        """
        x, y, z = np.moveaxis(np.asarray(directions), -1, 0)
        height, width, _ = self.pixels.shape
        column = np.arctan2(x, -z) / (2.0 * math.pi) * width - 0.5
        row = np.arccos(np.clip(y, -1.0, 1.0)) / math.pi * (height - 1)
        left = np.floor(column)
        top = np.minimum(np.floor(row), height - 2)
        a, b = (column - left)[..., None], (row - top)[..., None]
        i, j = left.astype(int), top.astype(int)

        def at(row: npt.NDArray[np.int_], column: npt.NDArray[np.int_]) -> Floats:
            return self.pixels[row, column % width]

        upper = (1.0 - a) * at(j, i) + a * at(j, i + 1)
        lower = (1.0 - a) * at(j + 1, i) + a * at(j + 1, i + 1)
        result: Floats = (1.0 - b) * upper + b * lower
        return result

    def pixel(self, directions: Floats) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Rows and columns of the nearest pixels to unit vectors of shape (..., 3)."""
        x, y, z = np.moveaxis(directions, -1, 0)
        height, width, _ = self.pixels.shape
        row = np.arccos(np.clip(y, -1.0, 1.0)) * ((height - 1) / math.pi) + 0.5
        column = np.arctan2(x, -z) * (width / (2.0 * math.pi))
        return row.astype(np.intp), np.floor(column).astype(np.intp) % width

    def exposed(self, mean: float = EXPOSURE) -> Environment:
        """This environment, scaled so that a white Lambertian sphere has a given mean luminance.

        The mean is over the disk that the sphere covers in an orthographic view from +z.
        """
        current = float(luminance(tuple(sphere_mean(self.pixels))))
        if current <= 0.0:
            raise ValueError("the map lights nothing that is seen from +z")
        return replace(self, pixels=self.pixels * np.float32(mean / current))


def sphere_mean(pixels: Floats) -> Floats:
    """Mean radiance of a white Lambertian sphere seen from +z under a map, shape (3,).

    Light from an angle a off the view contributes with the phase function of a Lambertian sphere,
    2 (sin a + (pi - a) cos a) / (3 pi), so no picture is needed.
    """
    directions, solid_angles = pixel_directions(*pixels.shape[:2])
    cosine = np.clip(directions[..., 2], -1.0, 1.0)
    angle = np.arccos(cosine)
    phase = (np.sin(angle) + (math.pi - angle) * cosine) * 2.0 / (3.0 * math.pi)
    mean: Floats = np.einsum("hwc,hw,h->c", pixels, phase / math.pi, solid_angles)
    return mean


def pixel_directions(height: int, width: int) -> tuple[Floats, Floats]:
    """Directions of the pixel centres of a map, and the solid angles of the pixels.

    Returns
    -------
    directions
        Unit vectors, shape (height, width, 3).
    solid_angles
        Of each pixel of a row in sr, shape (height,); the first and last rows are half as high as
        the others. They sum to 4 pi over all pixels.
    """
    theta = (np.arange(height) * (math.pi / (height - 1)))[:, None]
    phi = ((np.arange(width) + 0.5) * (2.0 * math.pi / width))[None, :]
    directions = np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)
        ),
        axis=-1,
    )
    return directions, -np.diff(_row_edges(height)) * (2.0 * math.pi / width)


def _row_edges(height: int) -> Floats:
    """Cosines of the polar angles between rows, from 1 down to -1, shape (height + 1,)."""
    edges = (np.arange(height + 1) - 0.5) * (math.pi / (height - 1))
    cosines: Floats = np.cos(np.clip(edges, 0.0, math.pi))
    return cosines


def golden_lattice(count: int) -> tuple[Floats, Floats]:
    """Evenly spread points of the unit square: (k + 1/2) / count and frac((k + 1/2) / golden ratio).

    Returns
    -------
    u, v
        Coordinates in [0, 1), shapes (count,).
    """
    index = np.arange(count) + 0.5
    return index / max(count, 1), np.modf(index * _GOLDEN)[0]


def quadrature(environment: Environment, count: int) -> tuple[Floats, Floats]:
    """Light directions and weights whose sums stand for integrals over the environment.

    For any function f of direction, the integral of f times radiance over the sphere is about
    `(f(directions) * weights).sum(0)`. Directions are drawn in proportion to luminance, by inverting
    its cumulative distribution over the pixels at :func:`golden_lattice`. Nothing is random: the
    same map and count give the same directions. The map counts as constant within a pixel, so every
    weight has the same luminance.

    Parameters
    ----------
    environment
        The map.
    count
        Number of directions, at least 1.

    Returns
    -------
    directions
        Unit vectors towards the light, shape (count, 3), float32.
    weights
        Radiance times solid angle, linear RGB, shape (count, 3), float32.
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

    edges = _row_edges(height)
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


def load_environment(path: PathLike) -> Environment:
    """Read a latitude-longitude map; negative values count as 0.

    Parameters
    ----------
    path
        An `.exr` or `.hdr` file of linear radiance, or an sRGB `.png`.

    Raises
    ------
    FormatError
        If the file is none of these, cannot be read, or holds no light.
    MissingExtraError
        If Mitsuba is not installed.
    """
    path = Path(path)
    if path.suffix.lower() not in EXTENSIONS:
        raise FormatError(f"{path}: an environment is one of {', '.join(EXTENSIONS)}")
    if not path.is_file():
        raise FormatError(f"{path}: no such file")
    mi = require("mitsuba", "render")
    try:
        bitmap = mi.Bitmap(str(path))
        if bitmap.pixel_count() > _MAX_PIXELS:
            raise FormatError(f"{path}: more than {_MAX_PIXELS} pixels; scale it down")
        bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        return Environment(np.maximum(np.array(bitmap), 0.0), path.stem)
    except (RuntimeError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
        reason = str(error).strip().splitlines()[-1]
        raise FormatError(f"{path}: not a usable environment: {reason}") from error
