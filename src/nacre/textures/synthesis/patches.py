"""How well every patch of a texture fits over given texels, by Fourier transforms."""

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
    correlations of a search come from a single inverse transform. Features have shape (height,
    width, k); patches of a periodic texture may reach over an edge and go on at the opposite one.
    """

    def __init__(self, features: Floats, patch: int, periodic: bool) -> None:
        planes = np.moveaxis(features.astype(np.float64), 2, 0)
        self._shape = planes.shape[1:]
        self._spectra = scipy.fft.rfft2(planes)
        self._energy = scipy.fft.rfft2(np.square(planes).sum(0))
        (height, width), beyond = self._shape, 0 if periodic else patch - 1
        self.rows, self.columns = height - beyond, width - beyond  # places of a first texel

    def errors(self, given: Floats, known: npt.NDArray[np.bool_]) -> Double:
        """Sums of squares for every patch, shape (rows, columns), by the place of its first texel.

        Features of the given texels have shape (patch, patch, k); those that are known count.
        """
        planes = np.moveaxis(np.where(known[..., None], given, 0.0), 2, 0).astype(np.float64)
        spectra = scipy.fft.rfft2(planes, self._shape)
        where = scipy.fft.rfft2(known.astype(np.float64), self._shape)
        product = where.conj() * self._energy
        product -= 2.0 * np.einsum("kyx,kyx->yx", spectra.conj(), self._spectra)
        sums: Double = scipy.fft.irfft2(product, self._shape)[: self.rows, : self.columns]
        sums += np.square(planes).sum()
        return np.maximum(sums, 0.0, out=sums)


def minimum_error_cut(errors: npt.NDArray[np.float64]) -> npt.NDArray[np.intp]:
    """The path from the first row to the last whose errors, of shape (rows, columns), have the
    lowest sum: its column in each row, shape (rows,).

    It steps by at most one column per row (Efros and Freeman 2001, section 2.1). Of paths with the
    same sum, it is the one that ends, and then goes, most to the left.
    """
    rows, columns = errors.shape
    total = np.empty((rows, columns + 2))
    total[:, [0, -1]] = np.inf
    total[0, 1:-1] = errors[0]
    for row in range(1, rows):
        above = total[row - 1]
        lowest = np.minimum(np.minimum(above[:-2], above[1:-1]), above[2:])
        total[row, 1:-1] = errors[row] + lowest
    path = np.empty(rows, np.intp)
    path[-1] = total[-1, 1:-1].argmin()
    for row in range(rows - 2, -1, -1):
        first = path[row + 1]
        path[row] = first - 1 + total[row, first : first + 3].argmin()
    return path


def inside_cuts(
    old: Floats, new: Floats, top: int, bottom: int, left: int, right: int
) -> npt.NDArray[np.bool_]:
    """Which texels of a patch lie inside the cuts through its overlaps.

    A cut costs the squared difference across it, between the last texel of what was there and the
    first of the patch: the seam that will be seen. The paper takes the difference of the two at the
    same texel. Features have shape (n, n, k); widths of overlaps are below n, 0 where there is
    none.
    """
    inside = np.ones(new.shape[:2], np.bool_)
    old_down, new_down = old.swapaxes(0, 1), new.swapaxes(0, 1)
    _cut(old, new, inside, left)
    _cut(old[:, ::-1], new[:, ::-1], inside[:, ::-1], right)
    _cut(old_down, new_down, inside.T, top)
    _cut(old_down[:, ::-1], new_down[:, ::-1], inside.T[:, ::-1], bottom)
    return inside


def _cut(old: Floats, new: Floats, inside: npt.NDArray[np.bool_], width: int) -> None:
    """Remove from `inside` what lies left of the cut through an overlap at the left."""
    if width:
        steps = new[:, 1 : width + 1] - old[:, :width]
        path = minimum_error_cut(np.square(steps).sum(-1, dtype=np.float64))
        inside[:, :width] &= np.arange(width) > path[:, None]
