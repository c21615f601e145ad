"""A texture as sums of a few functions of light and view, whose weights are bytes.

Roots of reflectance, luma and colors together, are a mean and a few principal components;
:mod:`nacre.textures.factors` has more of them, for luma and colors apart. Decoding is linear in the
weights up to a last square, so graphics cards may filter them as they filter colors, between texels
and between levels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.numerics.pca import leading_directions
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.factors import comparison, decoded_at_nodes, least_squares, split_roots
from nacre.textures.latent_map import LatentMap
from nacre.textures.mipmap import fill_levels, level_shapes, recorded

Bytes = npt.NDArray[np.uint8]

_TEXELS = 2048  # whose values give the components
_DECODED = 256  # of which functions are found at all nodes
_LARGEST = 255


@dataclass(frozen=True, eq=False)
class Channels:
    """Bytes of texels, and functions; roots are the mean and the sums of their products.

    Parameters
    ----------
    levels
        Bytes of each level of detail, shape (rows, columns, k), see
        :func:`nacre.textures.mipmap.level_shapes`. Levels after the first stand for means of
        reflectance.
    low, step
        The numbers that bytes b stand for are low + step b; shape (k,).
    mean
        At the nodes of a grid of directions as in :class:`nacre.textures.factors.Factors`: luma and
        the pair of colors, shape (nodes, 3).
    functions
        Of each number, shape (nodes, k, 3).
    """

    levels: tuple[Bytes, ...]
    low: Floats
    step: Floats
    mean: Floats
    functions: Floats


def channels(
    latent: LatentMap, count: int, resolution: int, progress: Progress = silent
) -> Channels:
    """The best `count` channels of an encoded texture, whose codec decodes at any directions.

    Functions are fitted to the rounded numbers. Progress is called with the nodes done.
    """
    height, width, _ = latent.shape
    codes = latent.codes.reshape(height * width, -1)
    random = np.random.default_rng(0)
    decode = on_all_cores(latent.codec, latent.codec.decoder(*comparison(random)))
    chosen = np.sort(random.permutation(len(codes))[:_TEXELS])

    seen = _roots(decode(codes[chosen].astype(np.float32)))
    mean = seen.mean(axis=0)
    seen -= mean
    (space,) = leading_directions(lambda: [(seen,)], 1, seen.shape[1], count, seed=0)
    narrow = np.asarray(space / np.sqrt(seen.shape[1]), np.float32)

    def weighed(values: Floats) -> Floats:
        found: Floats = (_roots(values) - mean) @ narrow
        return found

    maps = [np.empty((*shape, count), np.float32) for shape in level_shapes(height, width)]
    rows = (decode(row.astype(np.float32)) for row in latent.codes)
    fill_levels(recorded(rows, maps[0], weighed), maps, weighed)
    low = maps[0].min(axis=(0, 1))
    step = np.maximum((maps[0].max(axis=(0, 1)) - low) / _LARGEST, 1e-9)
    levels = tuple(
        np.clip(np.round((one - low) / step), 0, _LARGEST).astype(np.uint8) for one in maps
    )

    several = random.permutation(len(codes))[:_DECODED]
    kept = low + step * levels[0].reshape(len(codes), count)[several]
    solve = least_squares(np.concatenate([np.ones((len(several), 1)), kept], axis=1))
    found = np.empty((resolution**4, 1 + count, 3), np.float32)
    few = codes[several].astype(np.float32)
    for nodes, values in decoded_at_nodes(latent, few, resolution, progress):
        luma, chroma = split_roots(values)
        for each, part in enumerate((luma, *chroma)):
            found[nodes, :, each] = (solve @ part).T
    return Channels(levels, low, step, found[:, 0], found[:, 1:])


def _roots(values: Floats) -> Floats:
    """Luma and the pair of colors side by side, (t, 3 n), of reflectance factors (t, n, 3)."""
    luma, chroma = split_roots(values)
    return np.concatenate([luma, *chroma], axis=1)
