"""A texture as sums of a few functions of light and view that belong to it alone.

What a codec decodes for one texture varies far less than what it can decode for all. So roots of
values at some pairs of directions, as luma and pairs of colors
(:mod:`nacre.textures.codecs.basis.colors`), are factored into weights per texel and functions
(singular value decomposition); some texels, decoded at all nodes of a grid of directions, then give
the functions there by least squares. Any codec that decodes at any directions will do, and the cost
of a hit no longer depends on it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from nacre.array import Array, Components, Floats, namespace
from nacre.geometry import cosine_hemisphere, join, normalize, reflect
from nacre.numerics.pca import leading_directions
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.basis.colors import split_reflectance
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.latent_map import LatentMap
from nacre.textures.mipmap import fill_levels, level_shapes, recorded

LUMAS, CHROMAS = 96, 16  # functions of luma, and of both values of pairs of colors
_PAIRS = 2048  # pairs of directions that weights are found from
_TEXELS = 2048  # texels whose values there give the subspace; the weights of others follow from it
_DECODED = 256  # texels that are decoded at all nodes
_BLOCK = 1 << 12  # nodes at a time
_LOWEST = 0.15  # cosine of the steepest directions at which functions are compared
_RIDGE = 1e-6


@dataclass(frozen=True, eq=False)
class Factors:
    """Weights and functions; luma and pair, of roots, are sums of their products.

    Weights, of shape (t, :data:`LUMAS` + 2 :data:`CHROMAS`), belong to texels, row by row, then to
    those of coarser levels: for the luma, then for the first and the second value of the pair.
    Functions have shape (nodes, :data:`LUMAS` + :data:`CHROMAS`), with nodes of a grid of some
    resolution as :mod:`nacre.mitsuba.textures.decoders` has them.
    """

    weights: Floats
    functions: Floats
    resolution: int


def factor(
    latent: LatentMap, resolution: int, levels: int = 1, progress: Progress = silent
) -> Factors:
    """The factors of an encoded texture, whose codec must decode at any directions.

    The grid of directions has a resolution of at least 2. Weights are found for `levels` levels of
    the pyramid of mean reflectance, from the map itself on, see
    :func:`nacre.textures.mipmap.level_shapes`. Progress is called with the nodes done.
    """
    height, width, _ = latent.shape
    codes = latent.codes.reshape(height * width, -1)
    random = np.random.default_rng(0)
    decode = on_all_cores(latent.codec, latent.codec.decoder(*comparison(random)))
    chosen = np.sort(random.permutation(len(codes))[:_TEXELS])
    luma, chroma = split_roots(decode(codes[chosen].astype(np.float32)))
    seen = luma, chroma.reshape(-1, _PAIRS)
    spaces = leading_directions(lambda: [seen], 2, _PAIRS, max(LUMAS, CHROMAS), seed=0)
    # Functions have a mean square of 1 over the pairs.
    luma_space, chroma_space = (
        np.asarray(space[:, :count] / math.sqrt(_PAIRS), np.float32)
        for space, count in zip(spaces, (LUMAS, CHROMAS), strict=True)
    )

    def projected(values: Floats) -> Floats:
        luma, chroma = split_roots(values)
        return np.concatenate([luma @ luma_space, *(chroma @ chroma_space)], axis=1)

    weighed = on_all_cores(latent.codec, projected)
    shapes = level_shapes(height, width)[:levels]
    maps = [np.empty((*shape, LUMAS + 2 * CHROMAS), np.float32) for shape in shapes]
    rows = (decode(row.astype(np.float32)) for row in latent.codes)
    fill_levels(recorded(rows, maps[0], weighed), maps, weighed)
    weights = np.concatenate([one.reshape(-1, one.shape[2]) for one in maps])

    several = random.permutation(len(codes))[:_DECODED]
    luma_solve = least_squares(weights[several, :LUMAS])
    chroma_weights = weights[several, LUMAS:].reshape(-1, 2, CHROMAS).swapaxes(0, 1)
    chroma_solve = least_squares(chroma_weights.reshape(-1, CHROMAS))
    functions = np.empty((resolution**4, LUMAS + CHROMAS), np.float32)
    few = codes[several].astype(np.float32)
    for nodes, values in decoded_at_nodes(latent, few, resolution, progress):
        luma, chroma = split_roots(values)
        functions[nodes, :LUMAS] = (luma_solve @ luma).T
        functions[nodes, LUMAS:] = (chroma_solve @ chroma.reshape(-1, chroma.shape[2])).T
    return Factors(weights, functions, resolution)


def decoded_at_nodes(
    latent: LatentMap, codes: Floats, resolution: int, progress: Progress = silent
) -> Iterator[tuple[slice, Floats]]:
    """What codes (t, n) decode to at runs of nodes: the nodes, and factors (t, run, 3)."""
    side = node_directions(resolution)
    step = max(1, _BLOCK // len(side))
    for start in range(0, len(side), step):
        lights = side[start : start + step]
        nodes = slice(start * len(side), (start + len(lights)) * len(side))
        wi, wo = np.repeat(lights, len(side), 0), np.tile(side, (len(lights), 1))
        yield nodes, on_all_cores(latent.codec, latent.codec.decoder(wi, wo))(codes)
        progress("functions", nodes.stop, len(side) ** 2, "")


def node_directions(resolution: int) -> Floats:
    """The directions of one side of the grid, shape (resolution^2, 3).

    A hemisphere is an equal-area disk (Lambert's azimuthal projection) in a square; nodes outside
    the disk have the direction of the horizon that is nearest to them.
    """
    axis = np.linspace(-1.0, 1.0, resolution)
    y, x = (part.ravel() for part in np.meshgrid(axis, axis, indexing="ij"))
    radius = np.hypot(x, y)
    inside = np.minimum(radius, 1.0)
    scale = np.sqrt(2.0 - np.square(inside)) * inside / np.maximum(radius, 1e-12)
    directions = np.stack([x * scale, y * scale, 1.0 - np.square(inside)], axis=-1)
    return directions.astype(np.float32)


def grid_place(w: Components, resolution: int) -> tuple[Array, Array]:
    """Coordinates of a direction, in steps of the grid, along both axes of :func:`node_directions`.

    Components come from any array library; directions below the horizon are taken to lie on it.
    """
    xp, most = namespace(*w), resolution - 1.0
    scale = 1.0 / xp.sqrt(1.0 + xp.maximum(w[2], 0.0))
    x, y = (
        xp.minimum(xp.maximum((v * scale + 1.0) * (0.5 * most), 0.0), most) for v in (w[0], w[1])
    )
    return x, y


def roots(weights: Floats, functions: Floats, lumas: int) -> Components:
    """Luma and the pair of colors, shape (t, n) each, from weights of texels (t, lumas + 2 chromas)
    and functions at pairs of directions (n, lumas + chromas).
    """
    luma, chroma = functions[:, :lumas].T, functions[:, lumas:].T
    ends = lumas, lumas + len(chroma), lumas + 2 * len(chroma)
    first, second = (weights[:, start:end] @ chroma for start, end in itertools.pairwise(ends))
    return weights[:, :lumas] @ luma, first, second


def split_roots(values: Floats) -> tuple[Floats, Floats]:
    """Luma (t, n) and pairs of colors (2, t, n) of roots, from reflectance factors (t, n, 3)."""
    return split_reflectance(values, np.zeros(values.shape[1], np.float32))


def comparison(random: np.random.Generator) -> tuple[Floats, Floats]:
    """Pairs of directions, as dense as the product of their cosines; a quarter near highlights."""
    u = random.random((4, _PAIRS))
    span = 1.0 - _LOWEST**2
    wi, wo = cosine_hemisphere(span * u[0], u[1]), cosine_hemisphere(span * u[2], u[3])
    tilted = normalize((0.5 * wi[0], 0.5 * wi[1], 0.5 + wi[2]))
    mirrored = reflect(wo, tilted)
    lit = (np.arange(_PAIRS) % 4 == 1) & (mirrored[2] > _LOWEST)
    light = join(wi)
    light[lit] = join(mirrored)[lit]
    return light.astype(np.float32), join(wo).astype(np.float32)


def least_squares(weights: Floats) -> Floats:
    """The matrix that turns values (t, n) of texels into functions, (k, t)."""
    wide = weights.astype(np.float64)
    normal = wide.T @ wide
    normal += np.eye(len(normal)) * max(_RIDGE * float(np.trace(normal)) / len(normal), 1e-30)
    return np.asarray(np.linalg.solve(normal, wide.T), np.float32)
