"""Kinds of samplers as functions of free parameters, for networks that predict them."""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Mapping

import numpy as np

from nacre.array import Array, Floats, namespace
from nacre.brdf import Sampler
from nacre.sampling.lobes import MAX_EXPONENT, BlinnPhongMixture, blinn_phong_density
from nacre.sampling.mixture import GgxLobe, GgxMixture
from nacre.sampling.mixture_parameters import (
    MIN_COSINE,
    ROUGHNESSES,
    bounded,
    bounded_roughness,
    logistic,
    rounded_mixture,
)
from nacre.sampling.moment import Pairs
from nacre.sampling.registry import SAMPLERS
from nacre.sampling.visible_normals import visible_density


class Parametrization(abc.ABC):
    """Samplers of one kind, each a point of a space without bounds.

    Other packages' kinds name theirs in :meth:`nacre.brdf.Sampler.parametrizations`. Arrays are
    NumPy's or PyTorch's.
    """

    size: int  # number of free parameters

    @abc.abstractmethod
    def density(self, free: Array, pairs: Pairs) -> Array:
        """Densities in 1/sr, shape (..., v, n), for parameters (..., size)."""

    @abc.abstractmethod
    def sampler(self, free: Floats) -> Sampler:
        """The sampler for parameters (size,), whatever they are, with four digits of each."""

    def places(self, sampler: Sampler) -> Floats:
        """Where a sampler's parameters lie between their bounds, shape (size,), in [0, 1].

        The logistic function of free parameters gives the same; so a network learns from lobes.
        Raises ValueError if the sampler is of another kind.
        """
        raise ValueError(f"lobes of type {type(sampler).__name__} cannot be labels here")


class BlinnPhongParametrization(Parametrization):
    """:class:`BlinnPhongMixture`: log-odds of the fraction, and the place of the exponent's
    logarithm between its bounds.
    """

    size = 2

    def density(self, free: Array, pairs: Pairs) -> Array:
        fraction, exponent = (x[..., None, None] for x in self._bounded(free))
        lobe = blinn_phong_density(pairs.half, pairs.view, exponent)
        return fraction * lobe + (1.0 - fraction) / math.pi * pairs.cosine

    def sampler(self, free: Floats) -> BlinnPhongMixture:
        fraction, exponent = (float(f"{x:.4g}") for x in self._bounded(free))
        return BlinnPhongMixture(fraction, exponent)

    def places(self, sampler: Sampler) -> Floats:
        if not isinstance(sampler, BlinnPhongMixture):
            return super().places(sampler)
        width = math.log(max(sampler.exponent, 1.0)) / math.log(MAX_EXPONENT)
        return _within(sampler.specular / (1.0 - MIN_COSINE), width)

    @staticmethod
    def _bounded(free: Array) -> tuple[Array, Array]:
        fraction = (1.0 - MIN_COSINE) * logistic(free[..., 0])
        return fraction, namespace(free).exp(math.log(MAX_EXPONENT) * logistic(free[..., 1]))


class SingleLobeParametrization(Parametrization):
    """:class:`GgxMixture` with one isotropic lobe beside the cosine, the same for all views: the
    log-odds of its fraction and a free roughness.
    """

    size = 2

    def density(self, free: Array, pairs: Pairs) -> Array:
        fraction, alpha = (x[..., None, None] for x in self._bounded(free))
        lobe = visible_density(pairs.half, pairs.view, (alpha, alpha))
        return fraction * lobe + (1.0 - fraction) / math.pi * pairs.cosine

    def sampler(self, free: Floats) -> GgxMixture:
        fraction, alpha = ((float(f"{x:.4g}"),) for x in self._bounded(free))
        return GgxMixture((GgxLobe(fraction, alpha, alpha, (0.0,)),))

    def places(self, sampler: Sampler) -> Floats:
        if not isinstance(sampler, GgxMixture) or len(sampler.lobes) != 1:
            return super().places(sampler)
        (lobe,) = sampler.lobes
        low, high = np.log(ROUGHNESSES)
        width = (math.log(lobe.roughness[0]) - low) / (high - low)
        return _within(lobe.fraction[0] / (1.0 - MIN_COSINE), width)

    @staticmethod
    def _bounded(free: Array) -> tuple[Array, Array]:
        fraction = (1.0 - MIN_COSINE) * logistic(free[..., 0])
        return fraction, bounded_roughness(free[..., 1])


class MixtureParametrization(Parametrization):
    """:class:`GgxMixture` as :func:`fit_lobes` finds it, its lobes turning with the view."""

    cosines = 0.1, 0.45, 1.0
    lobes = 2
    size = len(cosines) * (2 + 4 * lobes)

    def density(self, free: Array, pairs: Pairs) -> Array:
        rows = free.reshape(*free.shape[:-1], len(self.cosines), -1)
        fractions, roughnesses, shifts = (
            self._of_views(part, pairs.view[2][:, :1]) for part in bounded(rows, self.lobes)
        )
        z = pairs.cosine
        diffuse = 0.5 / math.pi + 0.0 * z, 1.5 / math.pi * z * z
        lobes = (
            visible_density(
                pairs.half,
                pairs.view,
                (roughnesses[..., k, None], roughnesses[..., self.lobes + k, None]),
                shifts[..., k, None],
            )
            for k in range(self.lobes)
        )
        density = z / math.pi
        for k, lobe in enumerate((*diffuse, *lobes)):
            density = density + fractions[..., k, None] * (lobe - z / math.pi)
        return density

    def sampler(self, free: Floats) -> GgxMixture:
        rows = np.asarray(free, np.float64).reshape(len(self.cosines), -1)
        return rounded_mixture(rows, self.cosines, self.lobes)

    def _of_views(self, rows: Array, mu: Array) -> Array:
        """Parameters (..., v, c) at cosines of the view (v, 1), from rows (..., m, c)."""
        xp = namespace(rows)
        values = rows[..., 0, None, :]
        for k, (low, high) in enumerate(itertools.pairwise(self.cosines)):
            step = xp.minimum(xp.maximum((mu - low) / (high - low), 0.0), 1.0)
            values = values + step * (rows[..., k + 1, None, :] - rows[..., k, None, :])
        return values


def _within(*places: float) -> Floats:
    return np.clip(np.array(places, np.float64), 0.0, 1.0)


PARAMETRIZATIONS: Mapping[str, Parametrization] = {
    "blinn-phong": BlinnPhongParametrization(),
    "ggx": SingleLobeParametrization(),
    "mixture": MixtureParametrization(),
}
"""Those that the training of a basis predicts, by name in files."""

BEST = "mixture"  # the one with the least variance


def find_parametrization(name: str) -> Parametrization:
    """The parametrization of a name, from this or another package.

    Raises ValueError if no known sampler has one of this name.
    """
    for known in (PARAMETRIZATIONS, *(kind.parametrizations() for _, kind in SAMPLERS.members())):
        if name in known:
            found: Parametrization = known[name]
            return found
    raise ValueError(
        f"unknown sampler {name!r}; update nacre, or install the package that brings it"
    )
