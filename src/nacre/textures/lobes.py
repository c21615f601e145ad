"""Lobes to sample by, for texels of a texture: those whose sample weights vary least."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nacre.array import Floats
from nacre.color import luminance
from nacre.geometry import join, split, uniform_hemisphere
from nacre.sampling.tilted import PARAMETERS, fit_tilted
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.latent_map import LatentMap

_LIGHTS, _VIEWS = 160, 12
_TEXELS = 2048  # texels that have lobes of their own; larger maps share those of a coarser one
_BLOCK = 256
_LOWEST = 0.17  # cosine of the steepest of the views


def latent_lobes(latent: LatentMap) -> Floats:
    """Parameters of :class:`nacre.sampling.tilted.TiltedMixture` for an encoded texture, shape
    (height, width, 4): for every k-th row and column of the map, k = 1 where it is small.
    """
    lights, views = even_directions(_LIGHTS, 0.0), lobe_views()
    wi, wo = np.tile(lights, (_VIEWS, 1)), np.repeat(views, _LIGHTS, 0)
    decode = on_all_cores(latent.codec, latent.codec.decoder(wi, wo))
    codes = latent.codes[coarse_texels(*latent.codes.shape[:2])]
    flat = codes.reshape(-1, codes.shape[2]).astype(np.float32)
    areas = np.full(len(wi), 2.0 * math.pi / _LIGHTS, np.float32)
    found = fitted_lobes(len(flat), lambda part: decode(flat[part]), wi, wo, areas)
    return found.reshape(*codes.shape[:2], PARAMETERS)


def fitted_lobes(
    count: int, values: Callable[[slice], Floats], wi: Floats, wo: Floats, areas: Floats
) -> Floats:
    """Parameters for `count` texels, shape (count, 4), from the luminance of their values (t, n,
    3).
    """
    found = np.empty((count, PARAMETERS), np.float32)
    for start in range(0, count, _BLOCK):
        part = slice(start, start + _BLOCK)
        brightness = np.maximum(luminance(split(values(part))), 0.0)
        found[part] = fit_tilted(brightness, wi, wo, areas)
    return found


def lobe_views() -> Floats:
    return even_directions(_VIEWS, _LOWEST)


def coarse_texels(height: int, width: int) -> tuple[slice, slice]:
    """Rows and columns of a map that keep about as many texels as have lobes."""
    step = max(1, math.ceil(math.sqrt(height * width / _TEXELS)))
    return slice(None, None, step), slice(None, None, step)


def even_directions(count: int, lowest: float) -> Floats:
    """Evenly spread directions above a cosine: a lattice of the golden ratio, shape (count, 3)."""
    index = np.arange(count) + 0.5
    rotations = np.modf(index * 0.5 * (math.sqrt(5.0) - 1.0))[0]
    vectors = uniform_hemisphere((1.0 - lowest) * index / count, rotations)
    return join(vectors).astype(np.float32)
