"""How far the arrays of a texture are from what its codes decode to."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.geometry import cosine_hemisphere, join, split
from nacre.targets.textures.atlas import TextureAtlas, encoded
from nacre.textures.codecs.basis.colors import join_components
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.factors import CHROMAS, LUMAS, grid_place
from nacre.textures.latent_map import LatentMap

_TEXELS, _PAIRS = 256, 512


def error_lines(texture: Btf, atlas: TextureAtlas) -> list[str]:
    """Lines about the errors of the codes and of the arrays."""
    known = texture.describe()
    errors = {key: known.get(key) for key in ("MSE x 1e4", "relative RMSE")}
    stated = [f"{key} {value:.4g}" for key, value in errors.items() if isinstance(value, float)]
    error = 1e4 * mean_squared_error(atlas, encoded(texture))
    return [
        f"Error of the codes against their source: {', '.join(stated) or 'not recorded'}.",
        f"Error of the arrays against the codes: MSE x 1e4 {error:.3g}, of factors pi f_r.",
    ]


def mean_squared_error(atlas: TextureAtlas, latent: LatentMap) -> float:
    """The error of an atlas; see :func:`factors_error`."""
    weights = atlas.level_weights()[0].reshape(-1, LUMAS + 2 * CHROMAS).astype(np.float32)
    return factors_error(latent, weights, atlas.function_rows(), LUMAS)


def factors_error(
    latent: LatentMap, weights: Floats, functions: npt.NDArray[Any], lumas: int
) -> float:
    """Mean squared error of reflectance factors, at some texels and cosine-distributed directions.

    `latent` is exact. Weights are those of its texels, shape (t, lumas + 2 chromas), and functions
    are at nodes of a grid of directions, shape (nodes, lumas + chromas), as in
    :class:`nacre.textures.factors.Factors`.
    """
    random = np.random.default_rng(0)
    u = random.random((4, _PAIRS))
    light, view = (join(cosine_hemisphere(*part)).astype(np.float32) for part in (u[:2], u[2:]))
    codes = latent.codes.reshape(-1, latent.codes.shape[2])
    chosen = np.sort(random.permutation(len(codes))[:_TEXELS])
    decode = on_all_cores(latent.codec, latent.codec.decoder(light, view))
    expected = decode(codes[chosen].astype(np.float32))
    found = _decoded(weights[chosen], _between_nodes(functions, light, view), lumas)
    return float(np.mean(np.square(found - expected)))


def _between_nodes(functions: npt.NDArray[Any], light: Floats, view: Floats) -> Floats:
    """Functions at pairs of directions, shape (n, numbers)."""
    size = round(len(functions) ** 0.25)
    axes = []
    for w in (light, view):
        for place in grid_place(split(w), size):
            low = np.minimum(place.astype(np.intp), size - 2)
            axes.append(((low, 1.0 - (place - low)), (low + 1, place - low)))
    total = np.zeros((len(light), functions.shape[1]))
    for (lx, a), (ly, b), (vx, c), (vy, d) in itertools.product(*axes):
        values = functions[((ly * size + lx) * size + vy) * size + vx].astype(np.float32)
        total += (a * b * c * d)[:, None] * values
    return total


def _decoded(weights: Floats, functions: Floats, lumas: int) -> Floats:
    """Reflectance factors of texels (t, numbers), shape (t, n, 3)."""
    luma, chroma = functions[:, :lumas].T, functions[:, lumas:].T
    ends = lumas, lumas + len(chroma), lumas + 2 * len(chroma)
    first, second = (weights[:, start:end] @ chroma for start, end in itertools.pairwise(ends))
    return join(join_components(weights[:, :lumas] @ luma, first, second))
