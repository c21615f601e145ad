"""Samples of a scan as they would be through the smallest apertures.

A wide source and detector measure the mean of f_r over their apertures, which flattens highlights.
Each value is multiplied by how much more was measured than is the mean of the interpolated f_r over
the apertures: by the mean of these ratios over the apertures, a geometric one, a dozen times
(Richardson 1972, "Bayesian-Based Iterative Method of Image Restoration"; Lucy 1974). As the ratios
are averaged too, noise grows little.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import split
from nacre.measured.interpolation import (
    NEIGHBORS,
    SampleTree,
    logarithms,
    on_plane,
    shares,
    values_of,
)
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.parallel import thread_map
from nacre.sampling.apertures import aperture_nodes

ROUNDS = 12

_NODES = 32  # pairs of directions in the apertures of a sample
_DARK = 1e-4  # in 1/sr: added to values before ratios
_CHUNK = 1 << 7  # samples: with hundreds of bands, a chunk of them takes 100 MB


class _Cones(NamedTuple):
    """Neighbors of the pairs of directions in the apertures of m samples."""

    sample: npt.NDArray[np.int32]  # shape (m nodes, k)
    share: Floats  # as :func:`nacre.measured.interpolation.shares`
    weight: Floats  # of the pairs in the mean, shape (m, nodes)

    def mean(self, values: Floats) -> Floats:
        """Mean (m, channels) of values at the pairs of directions, (m nodes, channels)."""
        nodes = self.weight.shape[1]
        parts = values.reshape(*self.weight.shape, -1)
        return np.asarray(np.einsum("mn,mnc->mc", self.weight, parts) / nodes)


def sharpened(tree: SampleTree, samples: DirectionSamples, values: Floats) -> Floats:
    """Values (n, channels) of f_r in 1/sr whose means over the apertures are the given ones.

    `tree` searches the samples; values that are not positive stay as they are.
    """
    measured = np.maximum(values, 0.0) + _DARK

    def cones(start: int) -> _Cones:
        part = samples[np.arange(start, min(start + _CHUNK, len(values)))]
        wi, wo, weights = aperture_nodes(part, _NODES)
        near = tree.near(split(wi.reshape(-1, 3)), split(wo.reshape(-1, 3)), NEIGHBORS)
        return _Cones(near.sample.astype(np.int32), shares(near).astype(np.float32), weights)

    parts = list(thread_map(cones, range(0, len(values), _CHUNK)))
    found = measured
    for _ in range(ROUNDS):
        logs = logarithms(found - _DARK)
        seen = [c.mean(values_of(on_plane(c.sample, c.share, logs))) for c in parts]
        ratio = np.log(measured / (np.concatenate(seen) + _DARK))
        change = [c.mean(on_plane(c.sample, c.share, ratio)) for c in parts]
        found = np.maximum(found * np.exp(np.concatenate(change)), _DARK)
    return np.where(values > 0.0, found - _DARK, values)
