"""Codes in a neural basis: from a material, or from a few samples of it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.direction_samples import DirectionSamples
from nacre.latent.autoencoder import Autoencoder
from nacre.latent.directions import basis_inputs, isotropic_values, shared_directions
from nacre.latent.hypernetwork import Hypernetwork
from nacre.latent.neural_basis import BRIGHTEST, CHROMA, NeuralBasis
from nacre.latent.pca import Basis
from nacre.latent.refine import GAIN, optimised
from nacre.latent.weight_encoding import refine
from nacre.least_absolute import minimise
from nacre.parallel import one_blas_thread

SAMPLES = 2048
"""Samples of a material that is known everywhere: a code has a few dozen values."""
_STEPS = 15
PRIOR, _WEAK_PRIOR = 0.2, 0.05
"""What a standard deviation of a value costs, beside the sum of absolute errors: of few samples,
and of a material that is known everywhere."""
_FARTHEST = 100.0
"""Bound of the values that are found."""

Vector = npt.NDArray[np.float64]


def encode(basis: Basis | NeuralBasis | Hypernetwork | Autoencoder, brdf: Brdf) -> Vector:
    """The code of an isotropic material that comes closest in pictures, shape (k,).

    See :func:`encode_neural`, :func:`encode_network` and :func:`nacre.latent.refine.optimised`,
    which also have the errors.
    """
    if isinstance(basis, Hypernetwork | Autoencoder):
        return encode_network(basis, brdf)
    if isinstance(basis, NeuralBasis):
        return encode_neural(basis, brdf)
    return optimised(basis, brdf)


def encode_neural(basis: NeuralBasis, brdf: Brdf, seed: int = 0) -> Vector:
    """The code that comes closest in log(1 + 30 f cos theta_i).

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
    return encode_samples(basis, _known(brdf, seed), _WEAK_PRIOR)


def encode_network(basis: Hypernetwork | Autoencoder, brdf: Brdf, seed: int = 0) -> Vector:
    """The code whose network comes closest in log(1 + 30 f cos theta_i).

    It is sought from the code of the neural basis, or from that of the encoder. The parameters,
    what is returned and the errors are those of :func:`encode_neural`.
    """
    samples = _known(brdf, seed)
    if isinstance(basis, Autoencoder):
        start = basis.project(brdf)
    else:
        start = encode_samples(basis.basis, samples, _WEAK_PRIOR)
    return refine(basis, samples, start, _WEAK_PRIOR)


def encode_samples(basis: NeuralBasis, samples: DirectionSamples, prior: float = PRIOR) -> Vector:
    """The code of samples of an isotropic material, however few.

    The absolute differences of log(1 + 30 f cos theta_i) are brought to a minimum, together with
    the absolute values of the code: what the samples do not tell stays near the mean material.

    Parameters
    ----------
    basis
        What the code is for.
    samples
        Of the material, one or more.
    prior
        Weight of the absolute values of the code.

    Returns
    -------
    array of shape (k,)
        In standard deviations of the training materials.
    """
    with one_blas_thread():
        values = basis.values(basis_inputs(samples.wi, samples.wo)).astype(np.float64)
    weight = GAIN * samples.cosine[:, None].astype(np.float64)
    target = np.log1p(np.maximum(samples.rgb, 0.0) * weight)
    chroma = np.einsum("np,qc->pqnc", values[:, 1 + basis.greys :], CHROMA)
    rows = np.concatenate(
        [
            np.repeat(values[:, 1 : 1 + basis.greys].T[:, :, None], 3, axis=2),
            chroma.reshape(-1, *target.shape),
        ]
    )
    pull = prior * np.eye(len(basis))

    def residuals(code: Vector) -> Vector:
        logs = np.minimum(values @ basis.shares(code), BRIGHTEST)
        difference = np.log1p(np.exp(logs) * weight) - target
        return np.concatenate([difference.reshape(-1), prior * code])

    def jacobian(code: Vector, current: Vector) -> Vector:
        # Of v = log(1 + u) the derivative by ln u is 1 - e^-v.
        rate = -np.expm1(-(current[: target.size].reshape(target.shape) + target))
        return np.concatenate([(rows * rate).reshape(len(rows), -1), pull], axis=1)

    with one_blas_thread():
        return minimise(residuals, jacobian, np.zeros(len(basis)), _STEPS, _FARTHEST)[0]


def _known(brdf: Brdf, seed: int) -> DirectionSamples:
    """Samples of an isotropic material, as many as its code needs."""
    wi, wo = shared_directions(SAMPLES, seed)
    f_r = isotropic_values(brdf, wi, wo)
    return DirectionSamples(wi, wo, f_r)[f_r[:, 0] >= 0.0]
