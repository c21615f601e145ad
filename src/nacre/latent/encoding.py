"""Codes of materials."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.latent.autoencoder import Autoencoder
from nacre.latent.directions import check_isotropic
from nacre.latent.hypernetwork import Hypernetwork
from nacre.latent.neural_basis import NeuralBasis, grown
from nacre.latent.pca import Basis
from nacre.latent.picture_errors import PictureErrors
from nacre.latent.posterior import encode_samples
from nacre.latent.refine import optimised
from nacre.latent.weight_encoding import refine
from nacre.numerics.least_absolute import minimize
from nacre.runtime.parallel import one_blas_thread

_STEPS = 15
_PRIOR = 0.05
"""What a standard deviation of a value costs, beside the sum of errors of single directions."""
_FARTHEST = 100.0
"""Bound of the values that are found."""

Floats = npt.NDArray[np.floating]
Vector = npt.NDArray[np.float64]


def encode(basis: Basis | NeuralBasis | Hypernetwork | Autoencoder, brdf: Brdf) -> Vector:
    """The code of an isotropic material that comes closest in pictures, shape (k,).

    In a neural basis or a hypernetwork, a material that was measured at scattered samples has the
    code that is to be expected of these. See :func:`encode_neural`, :func:`encode_network`,
    :func:`nacre.latent.posterior.encode_samples` and :func:`nacre.latent.refine.optimized`, which
    also have the errors.
    """
    scan = brdf.scattered()
    if scan is not None and isinstance(basis, NeuralBasis | Hypernetwork):
        check_isotropic(brdf)
        return encode_samples(
            basis if isinstance(basis, NeuralBasis) else basis.basis, scan.samples
        )
    if isinstance(basis, Hypernetwork | Autoencoder):
        return encode_network(basis, brdf)
    if isinstance(basis, NeuralBasis):
        return encode_neural(basis, brdf)
    return optimised(basis, brdf)


def encode_neural(basis: NeuralBasis, brdf: Brdf, seed: int = 0) -> Vector:
    """The code that comes closest in pictures.

    The sum of the absolute :class:`~nacre.latent.picture_errors.PictureErrors` and of the absolute
    values of the code is brought to a minimum.

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
    with one_blas_thread():
        return _closest(basis, PictureErrors(brdf, seed))


def encode_network(basis: Hypernetwork | Autoencoder, brdf: Brdf, seed: int = 0) -> Vector:
    """The code whose network comes closest in pictures.

    It is sought from the code of the neural basis, or from that of the encoder. The parameters,
    what is returned and the errors are those of :func:`encode_neural`.
    """
    with one_blas_thread():
        errors = PictureErrors(brdf, seed)
        if isinstance(basis, Hypernetwork):
            begin = _closest(basis.basis, errors)
        else:
            begin = basis.project(brdf)
        return refine(basis, errors, begin, _PRIOR)


def _closest(basis: NeuralBasis, errors: PictureErrors) -> Vector:
    """The code with the least errors."""
    pull = _PRIOR * np.eye(len(basis), dtype=np.float32)
    common, rows = basis.logarithms(errors.wi, errors.wo)

    def residuals(code: Vector) -> Floats:
        own = (_PRIOR * code).astype(np.float32)
        return np.concatenate([errors.errors(grown(common, rows, code)), own])

    def jacobian(code: Vector, _: Floats) -> Floats:
        f_r = grown(common, rows, code)
        return np.concatenate([errors.slopes(f_r, rows * f_r), pull], axis=1)

    return minimize(residuals, jacobian, np.zeros(len(basis)), _STEPS, _FARTHEST)[0]
