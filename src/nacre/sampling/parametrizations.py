"""Kinds of samplers as functions of free parameters, for networks that predict them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from nacre.array import Array, Floats, namespace
from nacre.brdf import Sampler
from nacre.sampling.lobes import MAX_EXPONENT, BlinnPhongMixture, blinn_phong_density
from nacre.sampling.mixture import GgxLobe, GgxMixture
from nacre.sampling.mixture_parameters import (
    LEAST_COSINE,
    bounded,
    bounded_roughness,
    logistic,
    rounded_mixture,
)
from nacre.sampling.moment import Pairs
from nacre.sampling.visible_normals import visible_density


class LobeFamily(Protocol):
    """Samplers of one kind, each a point of a space without bounds."""

    @property
    def size(self) -> int:
        """Number of free parameters."""
        ...

    def density(self, free: Array, pairs: Pairs) -> Array:
        """Densities in 1/sr, shape (..., v, n), of parameters (..., size).

        NumPy arrays or PyTorch tensors.
        """
        ...

    def sampler(self, free: Floats) -> Sampler:
        """The sampler of parameters (size,), whatever they are, with four digits of each."""
        ...


class BlinnPhongFamily:
    """:class:`BlinnPhongMixture`: the shares' log-odds, and the place between the least and the
    greatest logarithm of the exponent.
    """

    size = 2

    def density(self, free: Array, pairs: Pairs) -> Array:
        """See :class:`LobeFamily`."""
        share, exponent = (x[..., None, None] for x in self._bounded(free))
        lobe = blinn_phong_density(pairs.half, pairs.view, exponent)
        return share * lobe + (1.0 - share) / math.pi * pairs.cosine

    def sampler(self, free: Floats) -> BlinnPhongMixture:
        """See :class:`LobeFamily`."""
        share, exponent = (float(f"{x:.4g}") for x in self._bounded(free))
        return BlinnPhongMixture(share, exponent)

    @staticmethod
    def _bounded(free: Array) -> tuple[Array, Array]:
        share = (1.0 - LEAST_COSINE) * logistic(free[..., 0])
        return share, namespace(free).exp(math.log(MAX_EXPONENT) * logistic(free[..., 1]))


class PlainGgxFamily:
    """:class:`GgxMixture` of one isotropic lobe beside the cosine, the same for all views: the
    share's log-odds and a free roughness.
    """

    size = 2

    def density(self, free: Array, pairs: Pairs) -> Array:
        """See :class:`LobeFamily`."""
        share, alpha = (x[..., None, None] for x in self._bounded(free))
        lobe = visible_density(pairs.half, pairs.view, (alpha, alpha))
        return share * lobe + (1.0 - share) / math.pi * pairs.cosine

    def sampler(self, free: Floats) -> GgxMixture:
        """See :class:`LobeFamily`."""
        share, alpha = ((float(f"{x:.4g}"),) for x in self._bounded(free))
        return GgxMixture((GgxLobe(share, alpha, alpha, (0.0,)),))

    @staticmethod
    def _bounded(free: Array) -> tuple[Array, Array]:
        share = (1.0 - LEAST_COSINE) * logistic(free[..., 0])
        return share, bounded_roughness(free[..., 1])


class MixtureFamily:
    """:class:`GgxMixture` as :func:`fit_lobes` finds it, its lobes turning with the view."""

    cosines = 0.1, 0.45, 1.0
    lobes = 2
    size = len(cosines) * (2 + 4 * lobes)

    def density(self, free: Array, pairs: Pairs) -> Array:
        """See :class:`LobeFamily`."""
        rows = free.reshape(*free.shape[:-1], len(self.cosines), -1)
        shares, roughnesses, shifts = (
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
            density = density + shares[..., k, None] * (lobe - z / math.pi)
        return density

    def sampler(self, free: Floats) -> GgxMixture:
        """See :class:`LobeFamily`."""
        rows = np.asarray(free, np.float64).reshape(len(self.cosines), -1)
        return rounded_mixture(rows, self.cosines, self.lobes)

    def _of_views(self, rows: Array, mu: Array) -> Array:
        """Parameters (..., v, c) at cosines of the view (v, 1), of rows (..., m, c)."""
        xp = namespace(rows)
        values = rows[..., 0, None, :]
        for k, (low, high) in enumerate(itertools.pairwise(self.cosines)):
            step = xp.minimum(xp.maximum((mu - low) / (high - low), 0.0), 1.0)
            values = values + step * (rows[..., k + 1, None, :] - rows[..., k, None, :])
        return values


FAMILIES: Mapping[str, LobeFamily] = {
    "blinn-phong": BlinnPhongFamily(),
    "ggx": PlainGgxFamily(),
    "mixture": MixtureFamily(),
}
"""Every kind by its name in files."""

BEST_FAMILY = "mixture"
"""The kind with the least variance."""
