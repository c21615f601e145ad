"""Image quilting: a texture made larger from patches of its own (Efros and Freeman 2001)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter, uniform_filter

from nacre.array import Floats
from nacre.runtime.progress import Progress, silent
from nacre.textures.synthesis.patches import PatchSearch, inside_cuts

_REPETITION = 0.3
"""How much errors of patches count more where the input has been used as often as on average."""
_APART = 0.1  # fraction of a patch by which patches are kept away from where a neighbor would go on

Sources = npt.NDArray[np.intp]
"""Which texel of the input every texel of the output is, y * width + x, shape (height, width)."""


@dataclass(frozen=True)
class Quilting:
    """How patches are laid; a ValueError says that a number is out of range."""

    patch: int  # edge of a patch in texels, at least 2
    overlap: int  # texels by which neighbors overlap, from 1 to half a patch
    tolerance: float = 0.1
    """Patches are drawn from all with errors at most this fraction above the lowest."""
    periodic: bool = False  # whether the input tiles: patches may reach over its edges
    tile: bool = False  # whether the output shall tile
    seed: int = 0

    def __post_init__(self) -> None:
        if self.patch < 2:
            raise ValueError(f"a patch has at least 2 texels per edge, not {self.patch}")
        if not 1 <= self.overlap <= self.patch // 2:
            raise ValueError(
                f"patches of {self.patch} overlap by 1 to {self.patch // 2} texels, "
                f"not {self.overlap}"
            )
        if not 0.0 <= self.tolerance < math.inf:
            raise ValueError(f"the tolerance is a number from 0, not {self.tolerance}")


def quilt(
    features: Floats, height: int, width: int, settings: Quilting, progress: Progress = silent
) -> Sources:
    """Lay patches in rows, each where it fits best over those before, and cut the overlaps.

    Two things go beyond the paper, so that the output does not just repeat the input. A patch that
    would only go on where a neighbor ends in the input, or nearly, is not taken, unless there is no
    other. And the more often texels have been used, the more errors of patches with them count:
    otherwise what fits anywhere, which is what is flat, comes to prevail.

    The input's features, shape (rows, columns, k), have the distances that cuts minimize. Height
    and width are the output's, and :data:`Sources` is what it is given as. Progress is called with
    the patches laid. A ValueError says that a patch is larger than the input or the output.
    """
    patch = settings.patch
    if patch > min(*features.shape[:2], height, width):
        raise ValueError(f"patches of {patch} texels are larger than the input or the output")
    canvas = _Canvas(features, height, width, settings)
    starts_y, starts_x = canvas.starts
    for index, (row, column) in enumerate(np.ndindex(len(starts_y), len(starts_x)), 1):
        canvas.lay(row, column)
        progress("quilting", index, len(starts_y) * len(starts_x), "")
    return canvas.sources[:height, :width]


class _Canvas:
    def __init__(self, features: Floats, height: int, width: int, settings: Quilting) -> None:
        self._settings = settings
        self._input = features.shape[:2]
        self._features = features.reshape(-1, features.shape[2])
        self._search = PatchSearch(features, settings.patch, settings.periodic)
        self._random = np.random.default_rng(settings.seed)
        self._used = np.zeros(self._input)
        self.starts = [_starts(n, settings) for n in (height, width)]
        ends = [starts[-1] + settings.patch for starts in self.starts]
        self.sources = np.full((height, width) if settings.tile else ends, -1, np.intp)

    def lay(self, row: int, column: int) -> None:
        around = np.arange(self._settings.patch)
        height, width = self.sources.shape
        down, across = self.starts
        place = np.ix_((down[row] + around) % height, (across[column] + around) % width)
        before = self.sources[place]
        known = before >= 0
        given = self._features[before]
        y, x = self._position(before, given, known)
        ys, xs = (y + around) % self._input[0], (x + around) % self._input[1]
        patch = ys[:, None] * self._input[1] + xs
        overlaps = [*self._overlaps(0, row), *self._overlaps(1, column)]
        inside = inside_cuts(given, self._features[patch], *overlaps)
        laid = np.where(inside | ~known, patch, before)
        np.subtract.at(self._used.reshape(-1), before[known], 1.0)
        np.add.at(self._used.reshape(-1), laid.reshape(-1), 1.0)
        self.sources[place] = laid

    def _overlaps(self, axis: int, index: int) -> tuple[int, int]:
        """Overlap of a patch with the one before, and of the last with the first where the output
        tiles.
        """
        starts, patch = self.starts[axis], self._settings.patch
        before = starts[index - 1] + patch - starts[index] if index else 0
        last = index == len(starts) - 1 and self._settings.tile
        return before, max(starts[index] + patch - self.sources.shape[axis], 0) if last else 0

    def _position(
        self, before: Sources, given: Floats, known: npt.NDArray[np.bool_]
    ) -> tuple[int, int]:
        """Where in the input the next patch is taken from."""
        shape = self._search.rows, self._search.columns
        if not known.any():
            y, x = (int(self._random.integers(n)) for n in shape)
            return y, x
        errors = self._search.errors(given, known) * self._repetition(shape)
        allowed = self._apart(before, known, shape)
        if allowed.any():
            errors[~allowed] = np.inf
        candidates = np.flatnonzero(errors <= (1.0 + self._settings.tolerance) * errors.min())
        y, x = divmod(int(self._random.choice(candidates)), shape[1])
        return y, x

    def _repetition(self, shape: tuple[int, int]) -> npt.NDArray[np.float64]:
        """Factor on errors, from how often the texels of a patch have been used."""
        size = self._settings.patch
        mean = uniform_filter(self._used, size, mode="wrap", origin=-(size // 2))
        weights: npt.NDArray[np.float64] = 1.0 + _REPETITION * mean / self._used.mean()
        return weights[: shape[0], : shape[1]]

    def _apart(
        self, before: Sources, known: npt.NDArray[np.bool_], shape: tuple[int, int]
    ) -> npt.NDArray[np.bool_]:
        """Which patches do not go on, or nearly, where a neighbor ends."""
        rows, columns = np.nonzero(known)
        y, x = np.divmod(before[known], self._input[1])
        apart = np.ones(self._input, np.bool_)
        apart[(y - rows) % self._input[0], (x - columns) % self._input[1]] = False
        reach = 2 * int(_APART * self._settings.patch) + 1
        mode = "wrap" if self._settings.periodic else "nearest"
        kept_apart: npt.NDArray[np.bool_] = minimum_filter(apart, reach, mode=mode)
        return kept_apart[: shape[0], : shape[1]]


def _starts(size: int, settings: Quilting) -> list[int]:
    """First texels of patches along an edge; evenly around it where the output tiles."""
    step = settings.patch - settings.overlap
    if settings.tile:
        count = max(2, math.ceil(size / step))
        return [index * size // count for index in range(count)]
    return list(range(0, max(size - settings.overlap, 1), step))
