"""One period of a surface: heights and what covers them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats

SMOOTHEST = 0.15  # least roughness alpha: sharper lobes would need more samples than are taken


@dataclass(frozen=True, eq=False)
class Mesostructure:
    """A square period of a surface on a grid of cells, seen as two flat triangles per cell.

    Cell (i, j) begins at y = i / size, x = j / size, in periods; y points up in a picture. Heights,
    in periods, are those at the first corner of each cell; texels refer to the plane at 0.
    """

    height: Floats  # shape (size, size)
    albedo: Floats  # linear RGB within [0, 1], shape (size, size, 3)
    specular: Floats  # Fresnel reflectance at normal incidence, likewise
    roughness: Floats
    """GGX alpha along and across the direction, at least SMOOTHEST, (size, size, 2)."""
    direction: Floats  # azimuth of strands in radians, shape (size, size)

    def __post_init__(self) -> None:
        size = len(self.height)
        shapes = ((), (3,), (3,), (2,), ())
        arrays = (self.height, self.albedo, self.specular, self.roughness, self.direction)
        for array, shape in zip(arrays, shapes, strict=True):
            if array.shape != (size, size, *shape) or not np.isfinite(array).all():
                raise ValueError(f"expected finite values of shape {(size, size, *shape)}")
        for color in (self.albedo, self.specular):
            if color.min() < 0.0 or color.max() > 1.0:
                raise ValueError("colors must lie within [0, 1]")
        if self.roughness.min() < SMOOTHEST - 1e-6:
            raise ValueError(f"roughness must be at least {SMOOTHEST}")

    @property
    def size(self) -> int:
        return len(self.height)

    def heights_in_cells(self) -> npt.NDArray[np.float32]:
        """Heights in units of the cells' side, shape (size, size)."""
        return np.ascontiguousarray(self.height * self.size, np.float32)

    def height_map(self) -> npt.NDArray[np.float32]:
        """Heights in periods, the last row of cells first, as in a picture; shape (size, size).

        A pixel's middle stands for the first corner of a cell: the picture begins half a cell
        before the first, so that no height is lost between corners.
        """
        return np.ascontiguousarray(self.height[::-1], np.float32)

    def coverings(self) -> npt.NDArray[np.float32]:
        """Albedo, specular, roughness and cosine and sine of the direction, (size, size, 10)."""
        azimuth = np.stack([np.cos(self.direction), np.sin(self.direction)], -1)
        parts = (self.albedo, self.specular, self.roughness, azimuth)
        return np.ascontiguousarray(np.concatenate(parts, -1), np.float32)
