"""How well every patch of a texture fits over texels that are given, by Fourier transforms."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.fft

from nacre.array import Floats

Double = npt.NDArray[np.float64]


class PatchSearch:
    """Sums of squared distances between given texels and all patches of a texture.

    A sum over a patch is the energy of the given texels, less twice their correlation with the
    texture, plus the correlation of the texture's energy with where texels are given. All
    correlations of a search come back in a single inverse transform.

    Parameters
    ----------
    features
        Of the texture, shape (height, width, k).
    patch
        Edge of a patch in texels.
    periodic
        Whether patches may reach over an edge and go on at the opposite one.
    """

    def __init__(self, features: Floats, patch: int, periodic: bool) -> None:
        planes = np.moveaxis(features.astype(np.float64), 2, 0)
        self._shape = planes.shape[1:]
        self._spectra = scipy.fft.rfft2(planes)
        self._energy = scipy.fft.rfft2(np.square(planes).sum(0))
        height, width = self._shape
        self.rows, self.columns = (
            self._shape if periodic else (height - patch + 1, width - patch + 1)
        )
        """Positions of the first texel of a patch."""

    def errors(self, given: Floats, known: npt.NDArray[np.bool_]) -> Double:
        """Of every patch, by the position of its first texel.

        Parameters
        ----------
        given
            Features of the texels, shape (patch, patch, k).
        known
            Which of them count, shape (patch, patch).

        Returns
        -------
        array
            Sums of squares, shape (:attr:`rows`, :attr:`columns`).
        """
        planes = np.moveaxis(np.where(known[..., None], given, 0.0), 2, 0).astype(np.float64)
        spectra = scipy.fft.rfft2(planes, self._shape)
        where = scipy.fft.rfft2(known.astype(np.float64), self._shape)
        product = where.conj() * self._energy
        product -= 2.0 * np.einsum("kyx,kyx->yx", spectra.conj(), self._spectra)
        sums: Double = scipy.fft.irfft2(product, self._shape)[: self.rows, : self.columns]
        sums += np.square(planes).sum()
        return np.maximum(sums, 0.0, out=sums)
