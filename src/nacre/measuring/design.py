"""Finds the pairs of directions whose measurement leaves the least uncertainty in pictures.

Near each of some codes, ln(f cos theta_i + e) at pairs of directions and views of the material are
nearly linear in the code. So it is known in advance how much measurements at given pairs narrow
down the views: the code's covariance is that of a linear regression. Pairs are chosen one by one,
each for the smallest remaining variance of the views, averaged over all codes. What a code cannot
express is similar at neighboring pairs, so that measuring near the same pair again tells little.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats
from nacre.color import GAMMA
from nacre.latent.directions import isotropic_inputs
from nacre.latent.neural_basis import NeuralBasis, decoded
from nacre.latent.posterior import DARK
from nacre.measuring.instrument import Exposures
from nacre.neural.inputs import ENHANCED
from nacre.runtime.parallel import one_blas_thread
from nacre.sampling.lit_views import LitViews, lit_views

VIEWS = 48
NOISE = 0.1
"""Standard deviation of the part of ln f_r that no code explains and that varies between pairs."""
ALIKE, REACH = 0.3, 0.1
"""The same for a part that is similar at neighboring pairs, and its reach in network inputs."""
UNKNOWN = 2.0
"""Standard deviation of codes around each of those that pairs are chosen for."""

_BLACK = 1e-4  # added to radiance: at black, the gamma curve has no derivative
_SMALLEST = 1e-3  # conditional variance below which rounding errors would count


class Design:
    """Measures how informative pairs of directions are for materials similar to some codes.

    Parameters
    ----------
    basis
        Of the codes.
    codes
        Materials to choose pairs for, shape (m, k).
    exposures
        To choose from.
    known
        Directions (n, 3) to the light and to the viewer that are already measured.
    lit
        The pictures that are to be known best; those of a sphere under lamps of many sizes if None.
    """

    def __init__(
        self,
        basis: NeuralBasis,
        codes: npt.ArrayLike,
        exposures: Exposures,
        known: tuple[Floats, Floats] | None = None,
        lit: LitViews | None = None,
    ) -> None:
        self.exposures = exposures
        count = exposures.wi.reshape(-1, 3).shape[0]
        self._chosen: list[int] = []
        pairs = exposures.wi.reshape(-1, 3), exposures.wo.reshape(-1, 3)
        if known is not None:
            pairs = tuple(np.concatenate([a, b]) for a, b in zip(pairs, known, strict=True))  # type: ignore[assignment]
        wi, wo = (w.astype(np.float32) for w in pairs)
        self._measured = list(range(count, len(wi)))
        self._groups = np.arange(count).reshape(len(exposures), -1)
        with one_blas_thread():
            values = np.asarray(codes, np.float64)
            self._slopes = _slopes(basis, values, wi, wo) / np.float32(NOISE)
            self._views = _view_roots(basis, values, lit or lit_views(1, VIEWS))
        self._inputs = isotropic_inputs(wi, wo, ENHANCED).astype(np.float64)

    @property
    def chosen(self) -> list[int]:
        """Indices of the exposures chosen so far."""
        return list(self._chosen)

    def left(self) -> float:
        """Mean variance of displayed values, over views and codes, that measurements leave."""
        with one_blas_thread():
            return float(_unknown(self._views, self._state()[0]).mean())

    def choose(self) -> int:
        """Choose the most informative exposure that is left, and return its index.

        Raises ValueError if there is none left.
        """
        if len(self._chosen) == len(self._groups):
            raise ValueError("no exposure is left to choose")
        with one_blas_thread():
            scores = self._scores()
        scores[self._chosen] = np.inf
        best = int(np.argmin(scores))
        self._chosen.append(best)
        return best

    def _alike(self, some: npt.NDArray[np.intp], others: npt.NDArray[np.intp]) -> Floats:
        """Covariances (..., a, b) of the similar part at pairs (..., a) and (..., b), in units of
        noise.
        """
        one, other = self._inputs[some][..., :, None, :], self._inputs[others][..., None, :, :]
        apart = np.square(one - other).sum(axis=-1)
        return np.asarray((ALIKE / NOISE) ** 2 * np.exp(-0.5 * apart / REACH**2))

    def _state(self) -> tuple[Floats, Floats, Floats]:
        """Covariances of codes, slopes, and noise covariances of each exposure, given measurements.

        Shapes are (m, k, k), (m, c, 3, k) and (g, p, p).
        """
        slopes, groups = self._slopes, self._groups
        m, c, _, k = slopes.shape
        prior = np.eye(k, dtype=np.float32) / UNKNOWN**2
        alike = self._alike(groups, groups) + np.eye(groups.shape[1])
        taken = np.array([*self._measured, *groups[self._chosen].reshape(-1)], np.intp)
        if not len(taken):
            return np.broadcast_to(np.linalg.inv(prior), (m, k, k)), slopes, alike
        noise = self._alike(taken, taken) + np.eye(len(taken))
        near = self._alike(np.arange(c), taken)
        told = np.linalg.solve(noise, near.T).T
        rows = slopes[:, taken].reshape(m, len(taken), -1)
        left = slopes - (told.astype(np.float32) @ rows).reshape(m, c, 3, k)
        whitened = np.linalg.inv(np.linalg.cholesky(noise)).astype(np.float32) @ rows
        whitened = whitened.reshape(m, -1, k)
        covariance = np.linalg.inv(prior + whitened.swapaxes(1, 2) @ whitened)
        return covariance, left, alike - told[groups] @ near[groups].swapaxes(1, 2)

    def _scores(self) -> npt.NDArray[np.float64]:
        """The value of :meth:`left` after each of the exposures."""
        covariances, slopes, noise = self._state()
        groups = self._groups
        noise = np.kron(noise + _SMALLEST * np.eye(groups.shape[1]), np.eye(3)).astype(np.float32)
        told = np.zeros(len(groups))
        for covariance, own, views in zip(covariances, slopes, self._views, strict=True):
            rows = own[groups].reshape(len(groups), -1, own.shape[-1])
            spread = rows @ covariance
            inner = spread @ rows.swapaxes(1, 2) + noise
            shown = spread @ views.T
            told += np.trace(np.linalg.solve(inner, shown @ shown.swapaxes(1, 2)), axis1=1, axis2=2)
        return np.asarray(_unknown(self._views, covariances).mean() - told / len(slopes))


def displayed(basis: NeuralBasis, codes: npt.ArrayLike) -> Doubles:
    """Displayed values in views of materials, shape (m, n)."""
    lit = lit_views(1, VIEWS)
    values = np.asarray(codes, np.float64)
    f_r = basis.reflectances(values, lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3))
    radiance = lit.radiance(f_r.reshape(len(values), *lit.wi.shape))
    shown = np.minimum(radiance, 1.0) ** (1.0 / GAMMA)
    return np.asarray(shown.reshape(len(values), -1), np.float64)


def _unknown(views: Floats, covariances: Floats) -> npt.NDArray[np.float64]:
    """Mean variances (m,) of views, from roots and covariances (m, k, k)."""
    found = np.einsum("mij,mjk,mik->m", views, covariances, views, optimize=True)
    return np.asarray(found, np.float64)


def _slopes(basis: NeuralBasis, codes: Floats, wi: Floats, wo: Floats) -> npt.NDArray[np.float32]:
    """Derivatives of ln(f cos theta_i + e) by the values of codes, shape (m, n, 3, k)."""
    common, rows = basis.logarithms(wi, wo)
    by_pair = rows.transpose(1, 2, 0)
    found = []
    for code in codes:
        scaled = decoded(common, rows, code) * wi[:, 2:]
        found.append(by_pair * (scaled / (scaled + DARK))[..., None])
    return np.array(found, np.float32)


def _view_roots(basis: NeuralBasis, codes: Floats, lit: LitViews) -> npt.NDArray[np.float32]:
    """R, shape (m, k, k), for which R^T R is the mean over views of products of derivatives.

    These are derivatives of displayed values by the values of the code.
    """
    common, rows = basis.logarithms(lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3))
    found = []
    for code in codes:
        f_r = decoded(common, rows, code)
        radiance = lit.radiance(f_r.reshape(*lit.wi.shape)) + _BLACK
        seen = lit.radiance((rows * f_r).reshape(len(rows), *lit.wi.shape))
        shown = (seen * (radiance ** (1.0 / GAMMA - 1.0) / GAMMA)).reshape(len(rows), -1)
        values, axes = np.linalg.eigh(shown @ shown.T / shown.shape[1])
        found.append((axes * np.sqrt(np.maximum(values, 0.0))).T)
    return np.array(found, np.float32)
