"""A height field for parallax."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.io.files import PathLike
from nacre.textures.height_file import full_depth, read_heights


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights over a texture, which lies in the plane of their mean.

    Parameters
    ----------
    heights
        Shape (rows, columns), the first row where v is 0.
    depth
        How many widths of the texture a difference of 1 stands for.
    """

    heights: Floats
    depth: float

    @classmethod
    def read(cls, path: PathLike, depth: float | None = None) -> HeightField:
        """A gray image as a height field, of the depth that its format stands for where None.

        Raises FormatError if it cannot be read.
        """
        return cls(read_heights(path), full_depth(path) if depth is None else depth)

    @property
    def pixels(self) -> npt.NDArray[np.float16]:
        """Heights over the plane in widths of the texture, shape (rows, columns, 1)."""
        heights = np.asarray(self.heights, np.float64)
        over = self.depth * (heights - heights.mean())
        return np.asarray(over[:, :, None], np.float16)
