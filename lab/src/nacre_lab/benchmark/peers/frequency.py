"""FreNBRDF: a loss in spherical-harmonic frequency (Zhou, Hu and Oztireli 2025, arXiv 2507.00476).

Their loss compares f_r cos(theta_i) in coefficients of spherical harmonics. The sphere is that of
the difference vector: its colatitude is 2 theta_d, its longitude 2 phi_d, so that the quarter of
directions in which Rusinkiewicz's d is measured becomes all of it. Coefficients of high degree
count more, by a Gaussian; the error is the mean square over coefficients, and a factor of 0.1 adds
it to their other loss, absolute errors of f_r cos(theta_i).

Own implementation. Theirs takes the two nearest samples of a batch for each point of the grid,
whatever their theta_h; this one evaluates the points, at one theta_h in each step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from scipy.special import sph_legendre_p_all

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import NacreError, require
from nacre.geometry import from_rusinkiewicz_angles, join
from nacre.neural import Recipe
from nacre.neural.fit_data import prepare
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.samples import direction_inputs
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.progress import silent
from nacre_lab.benchmark.peers.penalized import fit_with

torch: Any = require("torch", "torch")
Tensor: TypeAlias = Any

DEGREE = 15  # highest degree of the harmonics; 49 in the authors' example
SLICES = 24  # values of theta_h, denser near 0, where highlights are
_SPREAD = 50.0 / 49.0 * DEGREE  # standard deviation of the Gaussian over degrees, as in the example


@dataclass(frozen=True)
class SphereTransform:
    """The coefficients of spherical harmonics up to a degree, of functions on a grid.

    Colatitudes are Gauss-Legendre nodes, longitudes evenly spaced, so that the transform of
    functions within the degree is exact. Harmonics are orthonormal, with the Condon-Shortley phase.
    """

    degree: int

    @cached_property
    def colatitudes(self) -> Floats:
        """Shape (degree + 1,), in radians."""
        return np.arccos(np.polynomial.legendre.leggauss(self.degree + 1)[0])

    @cached_property
    def longitudes(self) -> Floats:
        """Shape (2 degree + 1,), in radians from 0."""
        count = 2 * self.degree + 1
        return np.arange(count) * (2.0 * math.pi / count)

    @cached_property
    def _legendre(self) -> Tensor:
        """Legendre functions times quadrature weights, shape (orders, degrees, colatitudes)."""
        orders = slice(self.degree + 1)  # the negative ones follow
        values = sph_legendre_p_all(self.degree, self.degree, self.colatitudes)[0, :, orders]
        weights = np.polynomial.legendre.leggauss(self.degree + 1)[1]
        step = 2.0 * math.pi / len(self.longitudes)
        scaled = values.transpose(1, 0, 2) * (weights * step)
        return torch.from_numpy(scaled).to(torch.complex64)

    def __call__(self, values: Tensor) -> Tensor:
        """Coefficients of real functions.

        Parameters
        ----------
        values
            Shape (colatitudes, longitudes, channels).

        Returns
        -------
        coefficients
            Shape (orders, degrees, channels), complex; orders from 0 on, as those below are their
            conjugates up to sign, and 0 where the order exceeds the degree.
        """
        around = torch.fft.rfft(values, dim=1)  # (colatitudes, orders, channels)
        return torch.einsum("mlt,tmc->mlc", self._legendre, around.to(torch.complex64))


class FrequencyTerm:
    """The loss in frequency, at one value of theta_h in each step, times a weight.

    Parameters
    ----------
    brdf
        The material.
    inputs
        What the network sees; see :func:`nacre.neural.inputs.network_inputs`.
    weight
        The factor; 0.1 in the paper.
    seed
        Seed of the order of the values of theta_h.
    """

    def __init__(self, brdf: Brdf, inputs: str, weight: float, seed: int = 0) -> None:
        self._transform = SphereTransform(DEGREE)
        self._random = np.random.default_rng((seed, 3))
        degrees = np.arange(DEGREE + 1)
        gaussian = np.exp(-0.5 * ((DEGREE - degrees) / _SPREAD) ** 2)[:, None]
        self._weight = torch.from_numpy(gaussian.astype(np.float32))
        # A mean over the coefficients of order >= 0, real and imaginary parts apart.
        self._scale = weight / (3 * (DEGREE + 1) ** 2)
        theta_h = 0.5 * math.pi * ((np.arange(SLICES) + 0.5) / SLICES) ** 2
        self._slices = [self._slice(brdf, inputs, angle) for angle in theta_h]

    def _slice(self, brdf: Brdf, inputs: str, theta_h: float) -> tuple[Tensor, Tensor, Tensor]:
        """Network inputs, cosines, and coefficients of the material at one theta_h."""
        grid = self._transform
        theta_d, phi_d = np.meshgrid(0.5 * grid.colatitudes, 0.5 * grid.longitudes, indexing="ij")
        angles = np.full_like(theta_d, theta_h), np.zeros_like(theta_d), theta_d, phi_d
        wi, wo = (
            join(w).reshape(-1, 3).astype(np.float32) for w in from_rusinkiewicz_angles(*angles)
        )
        seen = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0) & brdf.valid(wi, wo)
        f_r = np.where(seen[:, None], brdf.eval(wi, wo), 0.0)
        values = direction_inputs(DirectionSamples(wi, wo, f_r), brdf.isotropic, inputs)
        cosine = torch.from_numpy(np.where(seen, wi[:, 2], 0.0).astype(np.float32))[:, None]
        x = torch.from_numpy(np.nan_to_num(values).astype(np.float32))
        target = torch.from_numpy(f_r.astype(np.float32)) * cosine
        return x, cosine, self._coefficients(target)

    def _coefficients(self, values: Tensor) -> Tensor:
        shape = len(self._transform.colatitudes), len(self._transform.longitudes), 3
        found = self._transform(values.reshape(shape)) * self._weight
        return torch.view_as_real(found)

    def __call__(self, _: Tensor, f_r: Callable[[Tensor], Tensor]) -> Tensor:
        """See :data:`nacre_lab.benchmark.peers.penalized.Term`."""
        inputs, cosine, target = self._slices[self._random.integers(SLICES)]
        error = self._coefficients(f_r(inputs) * cosine) - target
        return self._scale * error.square().sum()


def fit_frequency(brdf: Brdf, recipe: Recipe, weight: float) -> NeuralBrdf:
    """A network trained with nacre's loss and a weight times that in frequency.

    Raises
    ------
    NacreError
        If the material is anisotropic, for which one theta_h is not enough; see :func:`nacre.fit`.
    """
    if not brdf.isotropic:
        raise NacreError(f"{brdf.name or 'this material'}: is for isotropic materials")
    material = prepare(brdf, replace(recipe, starts=1), silent)
    terms = [FrequencyTerm(brdf, material.recipe.chosen_inputs, weight, recipe.seed)]
    return fit_with(material, terms if weight else [])
