"""Reflectances made reciprocal and energy conserving as they are written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.metrics.metrics import angular_errors
from nacre.metrics.physics import reciprocity_error
from nacre.sampling.energy import albedos, views
from nacre.sampling.projection import Projection

_LIMIT = 0.995  # of the albedo; leaves room for the interpolation of a table
_TRIES = 4
_VIEWS = 96, 24
_PAIRS = 1 << 14


@dataclass(frozen=True)
class Change:
    """How a reflectance differs in the file; pairs are before and after."""

    reciprocity: tuple[float, float]  # nacre.metrics.physics.reciprocity_error
    albedo: tuple[float, float]  # the largest directional albedo of a channel
    median: float  # of the difference relative to f_r, over pairs of directions

    def __str__(self) -> str:
        before, after = self.reciprocity
        most, now = self.albedo
        return (
            f"reciprocity error from {before:.4f} to {after:.4f}, largest albedo from {most:.3f} "
            f"to {now:.3f}, f_r changed by {100.0 * self.median:.2g} % in the median"
        )


def write_physical(brdf: Brdf, path: Path, write: Callable[[Brdf, Path], object]) -> Change:
    """Write the :class:`nacre.sampling.projection.Projection` of a reflectance with `write`.

    If an albedo in the file is still above 1, it is written again with a lower limit. The
    reflectance must be known at all pairs of directions.

    Raises
    ------
    FormatError
        If the path cannot be written.
    NacreError
        If the albedo stays above 1.
    """
    limit = _LIMIT
    for _ in range(_TRIES):
        write(Projection(brdf, limit), path)
        written = load_brdf(path)
        largest = _largest_albedo(written)
        if largest <= 1.0:
            break
        limit *= _LIMIT / largest
    else:
        raise NacreError(f"{path}: reflects {largest:.3f} of the light; choose a finer table")
    return Change(
        (float(reciprocity_error(brdf).value), float(reciprocity_error(written).value)),
        (_largest_albedo(brdf), largest),
        angular_errors(brdf, written, _PAIRS).relative_median,
    )


def _largest_albedo(brdf: Brdf) -> float:
    """The largest directional albedo of a channel at 96 views; at 24 x 24 if anisotropic."""
    polar, azimuths = _VIEWS
    theta, phi = views(*((polar, 1) if brdf.isotropic else (azimuths, azimuths)))
    return float(albedos(brdf, np.stack([theta.ravel(), phi.ravel()]), 16).max())
