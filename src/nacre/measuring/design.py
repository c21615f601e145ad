"""The pairs of directions after which least is left unknown of what pictures show.

About each of some codes, ln(f cos theta_i + e) at pairs of directions and what views of the
material show are nearly linear in the code. So is known, before anything is measured, how far
measurements at given pairs narrow down the views: the code's covariance is that of a linear
regression. Pairs are chosen one after the other, each for the smallest mean variance of the views
that is left over all codes. What a code does not explain of a material is alike at neighboring
pairs, so that measuring the same once more tells little.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
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
"""Standard deviation of ln f_r that no code explains and that differs from pair to pair."""
ALIKE, REACH = 0.3, 0.1
"""The same of what is alike at neighboring pairs, and how far: in inputs of a network."""
UNKNOWN = 2.0
"""Standard deviation of codes about each of those that pairs are chosen for."""

_BLACK = 1e-4  # added to radiance: of black, the gamma curve has no derivative
_SMALLEST = 1e-3  # conditional variance below which rounding errors would count


class Design:
    """How much pairs of directions tell of materials like those of some codes.

    Parameters
    ----------
    basis
        Of the codes.
    codes
        Materials that pairs are to be chosen for, shape (m, k).
    exposures
        To choose from.
    known
        Directions (n, 3) to the light and to the viewer that were measured already.
    """

    def __init__(
        self,
        basis: NeuralBasis,
        codes: npt.ArrayLike,
        exposures: Exposures,
        known: tuple[Floats, Floats] | None = None,
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
            self._views = _view_roots(basis, values, lit_views(1, VIEWS))
        self._inputs = isotropic_inputs(wi, wo, ENHANCED).astype(np.float64)

    @property
    def chosen(self) -> list[int]:
        """Indices of the exposures that were chosen so far."""
        return list(self._chosen)

    def left(self) -> float:
        """Mean variance, over views and codes, of displayed values after what is measured."""
        with one_blas_thread():
            return float(_unknown(self._views, self._state()[0]).mean())

    def choose(self) -> int:
        """Index of the exposure that tells most beside those chosen and known; takes it.

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
        """Covariances (..., a, b) of what is alike at pairs (..., a) and (..., b), in noise."""
        one, other = self._inputs[some][..., :, None, :], self._inputs[others][..., None, :, :]
        apart = np.square(one - other).sum(axis=-1)
        return np.asarray((ALIKE / NOISE) ** 2 * np.exp(-0.5 * apart / REACH**2))

    def _state(self) -> tuple[Floats, Floats, Floats]:
        """Covariances (m, k, k) of codes, slopes (m, c, 3, k), and the covariances of noise of each
        exposure, (g, p, p): given what is measured.
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
        """What :meth:`left` would be after each of the exposures."""
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


def _unknown(views: Floats, covariances: Floats) -> npt.NDArray[np.float64]:
    """Mean variances (m,) of what views show, of roots and covariances (m, k, k)."""
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
    """R, shape (m, k, k): R^T R is the mean over views of the products of the derivatives, by the
    values of the code, of what they show.
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
