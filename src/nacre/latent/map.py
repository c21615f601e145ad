"""A map of materials: codes in the plane, neighbors side by side."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.errors import NacreError, require

MIN_CODES = 5  # minimum number of materials, or texels, on a map

_PERPLEXITY = 30.0


def embed(codes: npt.ArrayLike, seed: int = 0, what: str = "materials") -> Doubles:
    """Places of codes (n, k) in the plane by t-SNE (van der Maaten and Hinton 2008), shape (n, 2).

    The same seed gives the same map; `what` names the codes in errors. Raises NacreError if there
    are fewer than :data:`MIN_CODES`, and MissingExtraError if openTSNE is not installed.
    """
    values = np.asarray(codes, np.float64)
    if len(values) < MIN_CODES:
        raise NacreError(f"a map takes at least {MIN_CODES} {what}, got {len(values)}")
    tsne = require("openTSNE", "latent").TSNE(
        perplexity=_perplexity(len(values)),
        initialization="pca" if np.ptp(values, axis=0).any() else "random",  # all may be equal
        negative_gradient_method="bh",
        random_state=seed,
        n_jobs=1,
    )
    return np.asarray(tsne.fit(values), np.float64)


def embed_into(
    codes: npt.ArrayLike, places: npt.ArrayLike, new: npt.ArrayLike, seed: int = 0
) -> Doubles:
    """Places of new codes on a map of others, which stay where they are (Poličar et al. 2024).

    `codes` (n, k) are what :func:`embed` took and `places` what it returned; `new` codes (m, k) get
    places (m, 2), the same for the same seed.
    """
    library = require("openTSNE", "latent")
    values = np.asarray(codes, np.float64)
    perplexity = _perplexity(len(values))
    affinities = library.affinity.PerplexityBasedNN(
        values, perplexity=perplexity, random_state=seed, n_jobs=1
    )
    known = library.TSNEEmbedding(
        np.array(places, np.float64),
        affinities,
        negative_gradient_method="bh",
        random_state=seed,
        n_jobs=1,
    )
    closest = max(1, min(25, len(values) - 1))
    found = known.transform(np.asarray(new, np.float64), perplexity=min(5.0, perplexity), k=closest)
    return np.asarray(found, np.float64)


def _perplexity(count: int) -> float:
    return min(_PERPLEXITY, (count - 1) / 3.0)


def nearest(codes: npt.ArrayLike, index: int, count: int) -> list[int]:
    """The other codes that are closest to one of them, the closest first."""
    values = np.asarray(codes, np.float64)
    order = np.argsort(np.linalg.norm(values - values[index], axis=1), kind="stable")
    return [int(k) for k in order if k != index][:count]
