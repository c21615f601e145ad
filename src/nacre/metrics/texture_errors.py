"""How far values of one texture are from those of another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats
from nacre.compile.compilation import Compiled
from nacre.runtime.parallel import thread_slices

BIN = 15.0  # degrees of polar angle of the view per bin
UNITS = {
    "MSE x 1e4": "lower is better",
    "MAE": "reflectance factor; lower is better",
    "PSNR": "dB, for a peak of 1; higher is better",
    "relative RMSE": "lower is better, 0 is equal",
}
"""Units of :meth:`Errors.facts`, where they have one, and which way is better."""
_BINS = round(90.0 / BIN)
_PART = 64  # texels that a core compares at a time
_EDGE = 0.05  # degrees that a ring on an edge may be off

_compare = Compiled("nacre.metrics.error_loops:compare")


@dataclass(frozen=True)
class Errors:
    """Errors of reflectance factors over texels, pairs of directions and channels."""

    count: int  # values that were compared
    mse: float  # mean squared error
    mae: float  # mean absolute error
    relative: float
    """Root of the mean squared error over that of the mean square of the truth; NaN where the truth
    is black."""
    by_elevation: tuple[tuple[float, float, float], ...]
    """For each range of polar angles of the view that has pairs: its ends in degrees, and the mean
    squared error."""

    @property
    def psnr(self) -> float:
        """Peak signal-to-noise ratio in dB, for a peak of 1, perfect white."""
        return math.inf if self.mse == 0.0 else -10.0 * math.log10(self.mse)

    def facts(self) -> dict[str, Any]:
        """JSON-able, mean squares times 10,000 as papers print them."""
        return {
            "values compared": self.count,
            "MSE x 1e4": 1e4 * self.mse,
            "MAE": self.mae,
            "PSNR": self.psnr if math.isfinite(self.psnr) else None,
            "relative RMSE": self.relative if math.isfinite(self.relative) else None,
            "MSE x 1e4 by view": {
                f"{low:g}-{high:g} degrees": 1e4 * mse for low, high, mse in self.by_elevation
            },
        }

    def shown(self) -> tuple[dict[str, Any], dict[str, float]]:
        """The facts for people, whose PSNR may be infinite, and separately those by view."""
        facts = self.facts()
        by_view = facts.pop("MSE x 1e4 by view")
        return facts | {"PSNR": self.psnr}, by_view


class ErrorSums:
    """Adds up errors of parts of a texture, starting from the sums of an earlier one."""

    def __init__(self, sums: Doubles | None = None) -> None:
        self.sums = np.zeros((_BINS, 4)) if sums is None else sums.copy()
        """Of each range of views: values, squared errors, absolute errors, squared truth."""
        if self.sums.shape != (_BINS, 4) or self.sums.dtype != np.float64:
            found = f"{self.sums.dtype} {self.sums.shape}"
            raise ValueError(f"sums are {found}, expected float64 {(_BINS, 4)}")

    def add(
        self,
        truth: npt.NDArray[Any],
        other: Floats,
        wo: Floats,
        chosen: npt.NDArray[np.intp] | slice = slice(None),
    ) -> Floats:
        """Count texels, shape (b, n, 3), seen from `wo` of shape (n, 3).

        The truth may be in half precision, and have more pairs of directions, of which some are
        chosen. Returns the mean squared error of every texel, shape (b,).
        """
        texels = np.zeros(len(other), np.float32)

        def compared(part: slice) -> Floats:
            true = truth[part, chosen] if isinstance(chosen, slice) else truth[part].take(chosen, 1)
            true = np.asarray(true, np.float32)
            pairs = np.zeros((3, len(wo)), np.float32)
            _compare(true, np.asarray(other[part], np.float32), texels[part], pairs)
            return pairs

        parts = thread_slices(compared, len(other), _PART)
        sums: Doubles = np.sum(parts, axis=0, dtype=np.float64)
        polar = np.degrees(np.arccos(np.clip(wo[:, 2], -1.0, 1.0)))
        bins = np.clip((polar + _EDGE) / BIN, 0, _BINS - 1).astype(int)
        for column, values in enumerate(sums, 1):
            self.sums[:, column] += np.bincount(bins, values, _BINS)
        self.sums[:, 0] += np.bincount(bins, minlength=_BINS) * (3 * len(truth))
        return texels / (3 * len(wo))

    def result(self) -> Errors:
        """The errors of all that was counted; NaN where there is none."""
        with np.errstate(invalid="ignore", divide="ignore"):
            count, squares, absolute, truths = self.sums.sum(0)
            means = self.sums[:, 1] / self.sums[:, 0]
            by_view = tuple(
                (BIN * index, BIN * (index + 1), float(mean))
                for index, mean in enumerate(means)
                if self.sums[index, 0]
            )
            relative = float(np.sqrt(squares / truths)) if truths else math.nan
            return Errors(
                int(count), float(squares / count), float(absolute / count), relative, by_view
            )
