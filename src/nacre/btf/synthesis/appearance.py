"""Texels as a few numbers whose distances are distances of appearance."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.btf.latent_map import LatentMap, NeuralBtf
from nacre.parallel import one_blas_thread

_PAIRS = 64
"""Pairs of directions that appearance is compared at."""
_TEXELS = 4096
"""Texels that components are found from, at most."""
_LEFT_OUT = 0.01
"""Share of the variance that components may leave."""
_BLOCK = 1 << 25
"""Bytes of decoded values at a time."""


def appearance(latent: LatentMap, most: int = 16, pairs: int = _PAIRS, seed: int = 0) -> Floats:
    """Principal components of how texels look at some pairs of directions.

    Values are decoded and their roots taken, about as displays and eyes do, so that highlights do
    not outweigh all else. Squared distances are those of roots of reflectance factors, summed over
    the pairs and channels, but for the hundredth of the variance that is left out.

    Parameters
    ----------
    latent
        Codes and what decodes them.
    most
        Components, at most.
    pairs
        How many of the map's pairs of directions are looked at, drawn at random.
    seed
        Of those.

    Returns
    -------
    array
        Shape (height, width, components), their means zero.

    Raises
    ------
    FormatError
        If a code decodes to what is no number.
    """
    random = np.random.default_rng(seed)
    count = len(latent.wi)
    chosen = np.sort(random.choice(count, min(pairs, count), replace=False))
    btf = NeuralBtf(latent, (latent.wi[chosen], latent.wo[chosen]))
    total = btf.texel_count
    some = np.sort(random.choice(total, min(_TEXELS, total), replace=False))
    seen = _roots(btf.texels(some))
    mean = seen.mean(0)
    with one_blas_thread():  # the same features on any number of cores
        variances, directions = np.linalg.eigh(np.cov(seen, rowvar=False, bias=True))
        left_out = np.cumsum(np.maximum(variances, 0.0))
        needed = int(np.count_nonzero(left_out > _LEFT_OUT * left_out[-1]))
        kept = directions[:, ::-1][:, : min(max(needed, 1), most)]
        found = [(_roots(btf.texels(block)) - mean) @ kept for block in btf.blocks(_BLOCK)]
    features = np.concatenate(found)
    features -= features.mean(0)
    return features.reshape(btf.height, btf.width, -1)


def _roots(values: Floats) -> Floats:
    return np.sqrt(np.maximum(values, 0.0), dtype=np.float64).reshape(len(values), -1)
