"""Light from all around: latitude-longitude maps.

Orientation is that of Mitsuba's `envmap` emitter without `to_world`: +y is up, and a viewer who
looks along -z has +x at the right. Column u in [0, 1) and row v in [0, 1] of a map show the
direction with azimuth 2 pi u = atan2(x, -z) and polar angle pi v = acos(y). The middle column is
therefore +z: what lies *behind* a viewer who looks along -z, and what a mirror ball shows at its
center. Columns are centered at (i + 1/2) / width; rows lie at j / (height - 1), poles included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.color import luminance
from nacre.errors import FormatError, NacreError, reason
from nacre.io.files import PathLike, missing
from nacre.io.image_file import bitmaps, read_bitmap

EXPOSURE = 0.8
"""Mean radiance of a white Lambertian sphere under an exposed environment."""

EXTENSIONS = (".exr", ".hdr", ".png")
"""Endings of the files that :func:`load_environment` reads."""


@dataclass(frozen=True, eq=False)
class Environment:
    """Radiance from infinitely far away.

    Parameters
    ----------
    pixels
        Latitude-longitude map, shape (height, width, 3), float32, linear Rec. 709 RGB, finite and
        non-negative, not black everywhere; at least 2 x 2.
    name
        Shown to people.
    """

    pixels: npt.NDArray[np.float32]
    name: str = ""

    def __post_init__(self) -> None:
        shape = self.pixels.shape
        if len(shape) != 3 or shape[2] != 3 or min(shape) < 2:
            raise ValueError("an environment has three colors and 2 x 2 pixels or more")
        if not np.isfinite(self.pixels).all() or (self.pixels < 0.0).any():
            raise ValueError("radiance must be finite and non-negative")
        if not self.pixels.any():
            raise ValueError("the map is black everywhere")

    def radiance(self, directions: npt.ArrayLike) -> Floats:
        """Radiance from unit vectors, interpolated bilinearly; both have shape (..., 3)."""
        x, y, z = np.moveaxis(np.asarray(directions), -1, 0)
        height, width, _ = self.pixels.shape
        column = np.arctan2(x, -z) / (2.0 * math.pi) * width - 0.5
        row = np.arccos(np.clip(y, -1.0, 1.0)) / math.pi * (height - 1)
        left = np.floor(column)
        top = np.minimum(np.floor(row), height - 2)
        a, b = (column - left)[..., None], (row - top)[..., None]
        i, j = left.astype(int), top.astype(int)

        def at(row: npt.NDArray[np.int_], column: npt.NDArray[np.int_]) -> Floats:
            values: Floats = self.pixels[row, column % width]
            return values

        upper = (1.0 - a) * at(j, i) + a * at(j, i + 1)
        lower = (1.0 - a) * at(j + 1, i) + a * at(j + 1, i + 1)
        return np.asarray((1.0 - b) * upper + b * lower)

    def pixel(self, directions: Floats) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Rows and columns of the nearest pixels to unit vectors of shape (..., 3)."""
        x, y, z = np.moveaxis(directions, -1, 0)
        height, width, _ = self.pixels.shape
        row = np.arccos(np.clip(y, -1.0, 1.0)) * ((height - 1) / math.pi) + 0.5
        column = np.arctan2(x, -z) * (width / (2.0 * math.pi))
        return row.astype(np.intp), np.floor(column).astype(np.intp) % width

    def exposed(self, mean: float = EXPOSURE) -> Environment:
        """Scaled so that a white Lambertian sphere, seen from +z, has a given mean luminance."""
        current = float(luminance(tuple(sphere_mean(self.pixels))))
        if current <= 0.0:
            raise NacreError(f"{self.name or 'environment'}: lights nothing that is seen from +z")
        return replace(self, pixels=self.pixels * np.float32(mean / current))


def sphere_mean(pixels: Floats) -> Floats:
    """Mean radiance of a white Lambertian sphere under a map, over its disk seen from +z; (3,).

    No picture is needed: light at an angle a to the view is weighted by the phase function of a
    Lambertian sphere, 2 (sin a + (pi - a) cos a) / (3 pi).
    """
    directions, solid_angles = pixel_directions(*pixels.shape[:2])
    cosine = np.clip(directions[..., 2], -1.0, 1.0)
    angle = np.arccos(cosine)
    phase = (np.sin(angle) + (math.pi - angle) * cosine) * 2.0 / (3.0 * math.pi)
    return np.asarray(np.einsum("hwc,hw,h->c", pixels, phase / math.pi, solid_angles))


def balanced(name: str, pixels: Floats, balance: float = 1.0) -> Environment:
    """An exposed map; `balance` 1 makes a white Lambertian sphere seen from +z white on average."""
    mean = sphere_mean(pixels)
    white = pixels * (mean.mean() / mean) ** balance
    return Environment(white.astype(np.float32), name).exposed()


def pixel_directions(height: int, width: int) -> tuple[Floats, Floats]:
    """Unit vectors to the pixel centers of a map, shape (height, width, 3), and solid angles.

    Solid angles are those of one pixel of each row, in sr, shape (height,). The first and the last
    row are half as high as the others; all pixels add up to 4 pi.
    """
    theta = (np.arange(height) * (math.pi / (height - 1)))[:, None]
    phi = ((np.arange(width) + 0.5) * (2.0 * math.pi / width))[None, :]
    parts = np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)
    directions = np.stack(np.broadcast_arrays(*parts), axis=-1)
    return directions, -np.diff(row_edges(height)) * (2.0 * math.pi / width)


def row_edges(height: int) -> Floats:
    """Cosines of the polar angles between rows, from 1 down to -1, shape (height + 1,)."""
    edges = (np.arange(height + 1) - 0.5) * (math.pi / (height - 1))
    return np.asarray(np.cos(np.clip(edges, 0.0, math.pi)))


def load_environment(path: PathLike) -> Environment:
    """Read a latitude-longitude map: `.exr` or `.hdr` of linear radiance, or an sRGB `.png`.

    Negative values count as 0. Raises FormatError if the file is none of these, cannot be read, or
    holds no light; MissingExtraError if Mitsuba is not installed.
    """
    path = Path(path)
    if path.suffix.lower() not in EXTENSIONS:
        raise FormatError(f"{path}: an environment map ends in one of {', '.join(EXTENSIONS)}")
    if not path.is_file():
        raise missing(path)
    mi = bitmaps()
    try:
        bitmap = read_bitmap(path)
        bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        return Environment(np.maximum(np.array(bitmap), 0.0), path.stem)
    except FormatError:
        raise
    except MemoryError as error:
        raise FormatError(f"{path}: claims more pixels than memory holds") from error
    except (RuntimeError, ValueError) as error:
        raise FormatError(
            f"{path}: not a usable environment: {reason(error, whole=True)}"
        ) from error
