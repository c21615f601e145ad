"""Codes of materials."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.files import FormatError, NacreError
from nacre.latent.directions import shared_directions
from nacre.latent.lit_views import LitViews, lit_views
from nacre.latent.neural_basis import NeuralBasis, grown
from nacre.latent.pca import Basis
from nacre.latent.posterior import encode_samples
from nacre.latent.refine import GAIN, optimised
from nacre.least_absolute import minimise
from nacre.parallel import one_blas_thread

SAMPLES = 2048
"""Of the material: a code has a few dozen values."""
_STEPS = 15
_SEEN = 10.0
"""Weight of the mean error of what views see, beside that of single directions."""
_GAMMA = 1.0 / 2.2
_DARK = 1e-4
"""Added to what views see: of black, the gamma curve has no derivative."""
_PRIOR = 0.05
"""What a standard deviation of a value costs, beside the sum of errors of single directions."""
_FARTHEST = 100.0
"""Bound of the values that are found."""

Floats = npt.NDArray[np.float32]
Vector = npt.NDArray[np.float64]


def encode(basis: Basis | NeuralBasis, brdf: Brdf) -> Vector:
    """The code of an isotropic material that comes closest in pictures, shape (k,).

    In a neural basis, a material that was measured at scattered samples has the code that is to be
    expected of these. See :func:`encode_neural`, :func:`nacre.latent.posterior.encode_samples` and
    :func:`nacre.latent.refine.optimised`, which also have the errors.
    """
    if not isinstance(basis, NeuralBasis):
        return optimised(basis, brdf)
    scan = brdf.scattered()
    if scan is None:
        return encode_neural(basis, brdf)
    check_isotropic(brdf)
    return encode_samples(basis, scan.samples)


def encode_neural(basis: NeuralBasis, brdf: Brdf, seed: int = 0) -> Vector:
    """The code that comes closest in what pictures show.

    Two mean absolute errors are brought to a minimum together: that of log(1 + 30 f cos theta_i)
    over directions, and that of radiance to the power 1 / 2.2 over views that see more of the
    material than one direction, under an even sky and under lamps (:mod:`nacre.latent.lit_views`).
    The first alone leaves errors of one sign, which add up in such light.

    Parameters
    ----------
    basis
        What the code is for.
    brdf
        Isotropic.
    seed
        Of the directions: the same seed gives the same code.

    Returns
    -------
    array of shape (k,)
        In standard deviations of the training materials.

    Raises
    ------
    FormatError
        If `brdf` is anisotropic.
    NacreError
        If it is known at none of the directions.
    """
    wi, wo = shared_directions(SAMPLES, seed)
    f_r = isotropic_values(brdf, wi, wo)
    known = f_r[:, 0] >= 0.0
    with one_blas_thread():
        single = _Single(basis, wi[known], wo[known], f_r[known])
        seen = _Seen(basis, lit_views(seed), brdf)
        share = _SEEN * single.target.size / seen.target.size
        pull = _PRIOR * np.eye(len(basis))

        def residuals(code: Vector) -> Vector:
            parts = single.residuals(code), share * seen.residuals(code), _PRIOR * code
            return np.concatenate([part.reshape(-1) for part in parts])

        def jacobian(code: Vector, _: Vector) -> Vector:
            parts = single.jacobian(code), share * seen.jacobian(code), pull
            return np.concatenate([part.reshape(len(code), -1) for part in parts], axis=1)

        return minimise(residuals, jacobian, np.zeros(len(basis)), _STEPS, _FARTHEST)[0]


class _Single:
    """Errors of log(1 + 30 f cos theta_i) at directions, shape (n, 3)."""

    def __init__(self, basis: NeuralBasis, wi: Floats, wo: Floats, f_r: Floats) -> None:
        self._common, self._rows = basis.logarithms(wi, wo)
        self._weight = GAIN * wi[:, 2:].astype(np.float64)
        self.target = np.log1p(np.maximum(f_r, 0.0) * self._weight)

    def residuals(self, code: Vector) -> Vector:
        f_r = grown(self._common, self._rows, code)
        difference: Vector = np.log1p(f_r * self._weight) - self.target
        return difference

    def jacobian(self, code: Vector) -> Vector:
        scaled = grown(self._common, self._rows, code) * self._weight
        return np.asarray(self._rows * (scaled / (1.0 + scaled)))


class _Seen:
    """Errors of what views see, as a screen shows it, shape (views, lights, 3)."""

    def __init__(self, basis: NeuralBasis, lit: LitViews, brdf: Brdf) -> None:
        self._lit, shape = lit, lit.wi.shape
        wi, wo = lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3)
        f_r = isotropic_values(brdf, wi, wo).reshape(shape)
        self._known = f_r[..., :1] >= 0.0
        common, rows = basis.logarithms(wi, wo)
        self._common, self._rows = common.reshape(*shape[:2], 1), rows.reshape(-1, *shape)
        self.target = self._shown(np.maximum(f_r, 0.0))

    def residuals(self, code: Vector) -> Vector:
        difference: Vector = self._shown(self._f_r(code)) - self.target
        return difference

    def jacobian(self, code: Vector) -> Vector:
        f_r = self._f_r(code)
        slope = _GAMMA * (self._lit.radiance(f_r) + _DARK) ** (_GAMMA - 1.0)
        return np.asarray(self._lit.radiance(self._rows * f_r) * slope)

    def _f_r(self, code: Vector) -> Vector:
        return np.asarray(np.where(self._known, grown(self._common, self._rows, code), 0.0))

    def _shown(self, f_r: npt.NDArray[np.floating]) -> Vector:
        return np.asarray((self._lit.radiance(f_r) + _DARK) ** _GAMMA)


def isotropic_values(brdf: Brdf, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Floats:
    """f_r of an isotropic reflectance in 1/sr, shape (n, 3), float32; -1 where it is not known.

    Raises
    ------
    FormatError
        If `brdf` is anisotropic.
    NacreError
        If it is known at none of the directions.
    """
    check_isotropic(brdf)
    known = brdf.valid(wi, wo)
    if not known.any():
        raise NacreError(f"{brdf.name or 'reflectance'}: is known at none of the directions")
    return np.where(known[:, None], brdf.eval(wi, wo), -1.0).astype(np.float32)


def check_isotropic(brdf: Brdf) -> None:
    """Refuse a material that has no code.

    Raises
    ------
    FormatError
        If it is anisotropic.
    """
    if not brdf.isotropic:
        name = brdf.name or "reflectance"
        raise FormatError(f"{name}: is anisotropic; codes are for isotropic materials")
