"""How far the arrays of a texture are from what its codes decode to."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Components, Floats
from nacre.btf import Btf, Indices
from nacre.geometry import cosine_hemisphere, join, split
from nacre.targets.textures.shader_texture import ShaderTexture, encoded
from nacre.textures.codecs.basis.colors import join_components
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.factors import grid_place, roots
from nacre.textures.latent_map import LatentMap

_TEXELS, _PAIRS = 256, 512


Decoder: TypeAlias = Callable[[Indices, Floats, Floats], Components]
"""Luma and the pair of colors of texels, shape (t, n) each, at lights and views (n, 3)."""


def error_lines(texture: Btf, atlas: ShaderTexture) -> list[str]:
    """Lines about the errors of the codes and of the arrays."""
    known = texture.describe()
    errors = {key: known.get(key) for key in ("MSE x 1e4", "relative RMSE")}
    stated = [f"{key} {value:.4g}" for key, value in errors.items() if isinstance(value, float)]
    error = mean_squared_error(atlas, encoded(texture))
    return [
        f"Error of the codes against their source: {', '.join(stated) or 'not recorded'}.",
        f"Error of the arrays against the codes: MSE x 1e4 {1e4 * error:.3g}, of factors pi f_r.",
    ]


def mean_squared_error(atlas: ShaderTexture, latent: LatentMap) -> float:
    """Mean squared error of the reflectance factors of texels; see :func:`factors_error`."""
    rows = atlas.function_rows()
    return _error(
        latent,
        lambda texels, light, view: atlas.roots(texels, between_nodes(rows, light, view)),
    )


def factors_error(
    latent: LatentMap, weights: Floats, functions: npt.NDArray[Any], lumas: int
) -> float:
    """Mean squared error of reflectance factors, at some texels and cosine-distributed directions.

    `latent` is exact. Weights are those of its texels, shape (t, lumas + 2 chromas), and functions
    are at nodes of a grid of directions, shape (nodes, lumas + chromas), as in
    :class:`nacre.textures.factors.Factors`.
    """
    return _error(
        latent,
        lambda texels, light, view: roots(
            weights[texels], between_nodes(functions, light, view), lumas
        ),
    )


def compared_at(latent: LatentMap) -> tuple[Indices, Floats, Floats]:
    """Where errors are taken: texels of a map, and cosine-distributed lights and views (n, 3)."""
    random = np.random.default_rng(0)
    u = random.random((4, _PAIRS))
    light, view = (join(cosine_hemisphere(*part)).astype(np.float32) for part in (u[:2], u[2:]))
    height, width, _ = latent.shape
    return np.sort(random.permutation(height * width)[:_TEXELS]), light, view


def _error(latent: LatentMap, found: Decoder) -> float:
    chosen, light, view = compared_at(latent)
    codes = latent.codes.reshape(-1, latent.shape[2])
    decode = on_all_cores(latent.codec, latent.codec.decoder(light, view))
    expected = decode(codes[chosen].astype(np.float32))
    factors = join(join_components(*found(chosen, light, view)))
    return float(np.mean(np.square(factors - expected)))


def between_nodes(functions: npt.NDArray[Any], light: Floats, view: Floats) -> Floats:
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
