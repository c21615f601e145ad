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

    Heights have shape (rows, columns), with the first row at v = 0. A difference of 1 stands for
    `depth` widths of the texture.
    """

    heights: Floats
    depth: float

    @classmethod
    def read(cls, path: PathLike, depth: float | None = None) -> HeightField:
        """A gray image as a height field, by default with the depth that its format defines.

        Raises FormatError if it cannot be read.
        """
        return cls(read_heights(path), full_depth(path) if depth is None else depth)

    @property
    def pixels(self) -> npt.NDArray[np.float16]:
        """Heights over the plane in texture widths, shape (rows, columns, 1)."""
        heights = np.asarray(self.heights, np.float64)
        over = self.depth * (heights - heights.mean())
        return np.asarray(over[:, :, None], np.float16)
