"""Directions for integrals over a reflectance: fixed points, drawn where it is bright."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf, Sampler
from nacre.geometry import cosine_hemisphere, join, split
from nacre.numerics.sobol import sobol
from nacre.sampling.fit import fit_lobes

REPLICATES = 8
"""Independent sets of points; the spread of their results is the error estimate."""


def sobol_sets(dimensions: int, count: int, seed: int = 0) -> Floats:
    """Scrambled Sobol points in [0, 1), shape (:data:`REPLICATES`, count, dimensions).

    The number of points per set is a power of two.
    """
    generator = np.random.default_rng(seed)
    log2_count = int(count).bit_length() - 1
    return np.stack([sobol(dimensions, log2_count, generator) for _ in range(REPLICATES)])


class Proposal:
    """A reflectance's own sampler and the cosine, in equal parts (balance heuristic).

    Where the sampler is only the cosine, lobes are fitted first, so that a sharp highlight is found
    in any case.
    """

    def __init__(self, brdf: Brdf) -> None:
        own = brdf.sampler
        self._own: Sampler = own if own.adapted else fit_lobes(brdf)

    def draw(self, wo: Floats, u: Floats) -> Floats:
        """Directions to the light, shape (..., 2 n, 3): one from each part for each point.

        `wo` are float64 and `u` lie in [0, 1), both of shape (..., n, 3). Some directions lie below
        the horizon, where nothing is reflected.
        """
        wo, u = np.broadcast_arrays(wo, u)
        with np.errstate(all="ignore"):
            own, _ = self._own.sample_components(split(wo), split(u))
        cosine = cosine_hemisphere(u[..., 1], u[..., 2])
        drawn: Floats = np.concatenate([join(own), join(cosine)], axis=-2)
        return np.where(np.isfinite(drawn).all(axis=-1, keepdims=True), drawn, (0.0, 0.0, -1.0))

    def density(self, wi: Floats, wo: Floats) -> Floats:
        """Density in 1/sr of `wi` given `wo`, shape (...), for one draw from either part."""
        with np.errstate(all="ignore"):
            own = self._own.pdf_components(split(wi), split(wo))
        own = np.where((wi[..., 2] > 0) & (wo[..., 2] > 0) & np.isfinite(own), own, 0.0)
        return 0.5 * (own + np.maximum(wi[..., 2], 0.0) / math.pi)


def draw_pairs(proposal: Proposal, count: int) -> tuple[Floats, Floats]:
    """Pairs (wi, wo), shapes (:data:`REPLICATES`, 2 count, 3), with :func:`pair_density`."""
    u = sobol_sets(5, count)
    wo = join(cosine_hemisphere(u[..., 3], u[..., 4]))
    return proposal.draw(wo, u[..., :3]), np.concatenate([wo, wo], axis=-2)


def pair_density(proposal: Proposal, wi: Floats, wo: Floats) -> Floats:
    """Density of a drawn pair in 1/sr^2: views by their cosine, lights by the proposal."""
    return np.maximum(wo[..., 2], 0.0) / math.pi * proposal.density(wi, wo)
