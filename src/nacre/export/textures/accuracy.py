"""How far the arrays of a texture are from what its codes decode to."""

from __future__ import annotations

import itertools

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.export.textures.atlas import TextureAtlas, encoded
from nacre.geometry import cosine_hemisphere, join, split
from nacre.textures.codecs.basis.colors import join_components
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.factors import CHROMAS, LUMAS, grid_place
from nacre.textures.latent_map import LatentMap

_TEXELS, _PAIRS = 256, 512


def error_lines(texture: Btf, atlas: TextureAtlas) -> list[str]:
    """Lines on the errors of the codes and of the arrays."""
    known = texture.describe()
    errors = {key: known.get(key) for key in ("MSE x 1e4", "relative RMSE")}
    stated = [f"{key} {value:.4g}" for key, value in errors.items() if isinstance(value, float)]
    error = 1e4 * mean_squared_error(atlas, encoded(texture))
    return [
        f"Error of the codes against their source: {', '.join(stated) or 'not recorded'}.",
        f"Error of the arrays against the codes: MSE x 1e4 {error:.3g}, of factors pi f_r.",
    ]


def mean_squared_error(atlas: TextureAtlas, latent: LatentMap) -> float:
    """Of reflectance factors at some texels and pairs of directions, which are as dense as the
    product of their cosines.
    """
    random = np.random.default_rng(0)
    u = random.random((4, _PAIRS))
    light, view = (join(cosine_hemisphere(*part)).astype(np.float32) for part in (u[:2], u[2:]))
    codes = latent.codes.reshape(-1, latent.codes.shape[2])
    chosen = np.sort(random.permutation(len(codes))[:_TEXELS])
    decode = on_all_cores(latent.codec, latent.codec.decoder(light, view))
    expected = decode(codes[chosen].astype(np.float32))
    level = atlas.level_weights()[0]
    weights = level.reshape(len(codes), -1)[chosen].astype(np.float32)
    return float(np.mean(np.square(_decoded(weights, _functions(atlas, light, view)) - expected)))


def _functions(atlas: TextureAtlas, light: Floats, view: Floats) -> Floats:
    """Functions between nodes, shape (n, numbers)."""
    size = atlas.resolution
    axes = []
    for w in (light, view):
        for place in grid_place(split(w), size):
            low = np.minimum(place.astype(np.intp), size - 2)
            axes.append(((low, 1.0 - (place - low)), (low + 1, place - low)))
    total = np.zeros((len(light), 4 * len(atlas.functions)))
    for (lx, a), (ly, b), (vx, c), (vy, d) in itertools.product(*axes):
        pixels = atlas.functions[:, ly * size + vy, lx * size + vx]
        values = pixels.swapaxes(0, 1).reshape(len(light), -1).astype(np.float32)
        total += (a * b * c * d)[:, None] * values
    return total


def _decoded(weights: Floats, functions: Floats) -> Floats:
    """Reflectance factors of texels (t, numbers), shape (t, n, 3)."""
    luma, chroma = functions[:, :LUMAS].T, functions[:, LUMAS:].T
    ends = LUMAS, LUMAS + CHROMAS, LUMAS + 2 * CHROMAS
    first, second = (weights[:, start:end] @ chroma for start, end in itertools.pairwise(ends))
    return join(join_components(weights[:, :LUMAS] @ luma, first, second))
