"""Texels as a few numbers whose distances are distances of appearance."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.errors import FormatError
from nacre.runtime.parallel import one_blas_thread
from nacre.textures.embedding import appearance
from nacre.textures.latent_map import LatentMap

_TEXELS = 4096
"""Texels that components are found from, at most."""
_LEFT_OUT = 0.01
"""Share of the variance that components may leave."""
_BLOCK = 1 << 12
"""Texels at a time."""


def texel_features(latent: LatentMap, most: int = 16, seed: int = 0) -> Floats:
    """Principal components of how texels look at the directions of a map.

    Squared distances are those of :func:`nacre.textures.embedding.appearance`, but for the
    hundredth of the variance that is left out.

    Parameters
    ----------
    latent
        Codes and what decodes them.
    most
        Components, at most.
    seed
        Of the texels that they are found from, where there are many.

    Returns
    -------
    array
        Shape (height, width, components), their means zero.

    Raises
    ------
    FormatError
        If a code decodes to what is no number.
    """
    height, width, values = latent.codes.shape
    codes = latent.codes.reshape(-1, values).astype(np.float32)
    total = len(codes)
    some = np.random.default_rng(seed).choice(total, min(_TEXELS, total), replace=False)
    with one_blas_thread():  # the same features on any number of cores
        looks = appearance(latent.codec, (latent.wi, latent.wo))
        seen = looks(codes[np.sort(some)]).astype(np.float64)
        if not np.isfinite(seen).all():
            raise FormatError(f"{latent.name}: some codes decode to values that are not finite")
        mean = seen.mean(0)
        variances, directions = np.linalg.eigh(np.cov(seen, rowvar=False, bias=True))
        left_out = np.cumsum(np.maximum(variances, 0.0))
        needed = int(np.count_nonzero(left_out > _LEFT_OUT * left_out[-1]))
        kept = directions[:, ::-1][:, : min(max(needed, 1), most)]
        blocks = (codes[start : start + _BLOCK] for start in range(0, total, _BLOCK))
        features = np.concatenate([(looks(block) - mean) @ kept for block in blocks])
    features -= features.mean(0)
    if not np.isfinite(features).all():
        raise FormatError(f"{latent.name}: some codes decode to values that are not finite")
    return features.reshape(height, width, -1)
