"""Reflectance that is made reciprocal and limited in energy on its way to a file."""

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

_LIMIT = 0.995  # of the albedo; the rest is for what a table interpolates
_TRIES = 4
_VIEWS = 96, 24
_PAIRS = 1 << 14


@dataclass(frozen=True)
class Change:
    """What writing a reflectance as a physical one has changed.

    Parameters
    ----------
    reciprocity
        :func:`nacre.metrics.physics.reciprocity_error` before and in the file.
    albedo
        The largest directional albedo of a channel before and in the file.
    median
        Of the difference between file and source relative to f_r, over pairs of directions.
    """

    reciprocity: tuple[float, float]
    albedo: tuple[float, float]
    median: float

    def __str__(self) -> str:
        before, after = self.reciprocity
        most, now = self.albedo
        return (
            f"reciprocity error from {before:.4f} to {after:.4f}, largest albedo from {most:.3f} "
            f"to {now:.3f}, f_r changed by {100.0 * self.median:.2g} % in the median"
        )


def write_physical(brdf: Brdf, path: Path, write: Callable[[Brdf, Path], object]) -> Change:
    """Write the :class:`nacre.sampling.projection.Projection` of a reflectance.

    Where the file that comes of it still has an albedo above 1, it is written again with a limit
    that is as much lower.

    Parameters
    ----------
    brdf
        Any reflectance that is known at all pairs of directions.
    path
        File to write.
    write
        Writes a reflectance to a path.

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
        largest = largest_albedo(written)
        if largest <= 1.0:
            break
        limit *= _LIMIT / largest
    else:
        raise NacreError(f"{path}: reflects {largest:.3f} of the light; a finer table would not")
    return Change(
        (float(reciprocity_error(brdf).value), float(reciprocity_error(written).value)),
        (largest_albedo(brdf), largest),
        angular_errors(brdf, written, _PAIRS).relative_median,
    )


def largest_albedo(brdf: Brdf) -> float:
    """The largest directional albedo of a channel at 96 views; of an anisotropic one at 24 x 24."""
    polar, azimuths = _VIEWS
    theta, phi = views(*((polar, 1) if brdf.isotropic else (azimuths, azimuths)))
    return float(albedos(brdf, np.stack([theta.ravel(), phi.ravel()]), 16).max())
