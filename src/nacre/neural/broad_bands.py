"""Narrow bands of a spectrum from a few broad ones.

A spectral network (:mod:`nacre.neural.spectral`) learns means over broad bands, which overlap and
together cover the spectrum: each is positive, as bright as its neighbors, and less noisy than a
narrow band. The spectra of one material have few degrees of freedom, so a linear map leads back
from these means to every band, closely.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles

_RIDGE = 1e-5  # pull to linear interpolation between the centers, relative to the means' size
_DARK = 0.01  # f_r in 1/sr: below it, errors no longer count relative to f_r


@dataclass(frozen=True)
class BroadBands:
    """Overlapping triangles with even centers, or the bands themselves where there are no more.

    `centers` are in nm, shape (k,); `weights`, shape (bands, k), whose columns sum to 1, make the
    means; `between`, shape (k, bands), interpolates linearly between the centers.
    """

    centers: Doubles
    weights: Doubles
    between: Doubles

    @classmethod
    def of(cls, wavelengths: npt.ArrayLike, count: int) -> BroadBands:
        """At most so many broad bands of a spectrum in bands in nm, shape (bands,), increasing."""
        bands = np.asarray(wavelengths, np.float64)
        if len(bands) <= count:
            return cls(bands, np.eye(len(bands)), np.eye(len(bands)))
        # Even in the bands' numbers: where bands are dense, so are the centers.
        places, numbers = np.linspace(0.0, len(bands) - 1.0, count), np.arange(len(bands))
        between = np.stack([np.interp(numbers, places, unit) for unit in np.eye(count)])
        weights = between.T / between.sum(axis=1)
        return cls(np.interp(places, numbers, bands), weights, between)

    def means(self, spectra: npt.ArrayLike) -> Doubles:
        """Means of spectra, shapes (..., bands) and (..., k); what is negative counts as 0."""
        return np.asarray(np.maximum(np.asarray(spectra, np.float64), 0.0) @ self.weights)

    def rebuilding(self, spectra: npt.ArrayLike) -> Doubles:
        """The matrix (k, bands) that rebuilds spectra (n, bands) from their means most closely.

        Least squares of errors relative to the brightness of a spectrum.
        """
        values = np.maximum(np.asarray(spectra, np.float64), 0.0)
        means = self.means(values)
        scale = 1.0 / (means.mean(axis=1, keepdims=True) + _DARK)
        known, wanted = means * scale, values * scale
        square = known.T @ known
        ridge = _RIDGE * max(np.trace(square), 1e-30) * np.eye(len(square))
        off = known.T @ (wanted - known @ self.between)
        return np.asarray(self.between + np.linalg.solve(square + ridge, off))
