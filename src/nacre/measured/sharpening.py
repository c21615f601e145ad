"""Samples of a scan as they would be through the smallest apertures.

A wide source and detector measure the mean of f_r over their apertures, which flattens highlights.
Each value is multiplied by what the mean leaves out: its ratio to the mean of the interpolated f_r
over the apertures, again and again (Gold 1964, "An iterative unfolding method for response
matrices"). Ratios that noise can explain are left alone, as undoing them would make it larger.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import split
from nacre.measured.interpolation import NEIGHBORS, SampleTree, logarithms, shares, weighted
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.parallel import thread_map
from nacre.sampling.apertures import aperture_nodes

ROUNDS = 8

_NODES = 32  # pairs of directions in the apertures of a sample
_DARK = 1e-4  # in 1/sr: added to values before ratios
_CHUNK = 1 << 10  # samples
_AGREEMENT = 0.01
"""Logarithm of a ratio that is left alone where the noise is not known."""


def sharpened(tree: SampleTree, samples: DirectionSamples, values: Floats) -> Floats:
    """Values (n, channels) of f_r in 1/sr that have the given ones as their means over apertures.

    `tree` searches the samples; negative values stay as they are.
    """
    measured = np.maximum(values, 0.0)
    noise = np.zeros(len(values)) if samples.sigma is None else samples.sigma
    left = np.maximum(_AGREEMENT, noise[:, None] / (measured + _DARK))

    def neighbors(start: int) -> tuple[npt.NDArray[np.int32], Floats, Floats]:
        part = samples[np.arange(start, min(start + _CHUNK, len(values)))]
        wi, wo, weights = aperture_nodes(part, _NODES)
        near = tree.near(split(wi.reshape(-1, 3)), split(wo.reshape(-1, 3)), NEIGHBORS)
        return near.sample.astype(np.int32), shares(near).astype(np.float32), weights

    known = list(thread_map(neighbors, range(0, len(values), _CHUNK)))
    found = measured
    for _ in range(ROUNDS):
        logs = logarithms(found)
        means = []
        for near, parts, weights in known:
            f_r = weighted(near, parts, logs).reshape(*weights.shape, -1)
            means.append(np.einsum("nk,nkc->nc", weights, f_r) / weights.shape[1])
        ratio = (measured + _DARK) / (np.concatenate(means) + _DARK)
        change = np.abs(np.log(ratio)) > left
        if not change.any():
            break
        found = np.where(change, (found + _DARK) * ratio - _DARK, found)
        found = np.maximum(found, 0.0)
    return np.where(values > 0.0, found, values)
