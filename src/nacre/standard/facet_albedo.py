"""Directional albedos of GGX microfacets, in the tables that Cycles uses to layer its closures.

These are averages over the normals that a direction sees, by quadrature: of masking in reflection
(Heitz 2018, "Sampling the GGX Distribution of Visible Normals", equation 19), and of the Fresnel
reflectance.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from nacre.analytic.fresnel import dielectric
from nacre.array import Table
from nacre.geometry import dot, reflect
from nacre.sampling.visible_normals import sample_visible, stretched_length

_LOWEST = 1e-4  # of roughness, cosine and the coordinate of the index
_ALBEDO_NODES, _FRESNEL_NODES, _BINS = 32, 16, 512


@cache
def albedo_table() -> Table:
    """Albedo of facets that reflect everything, in [0, 1].

    The axes are roughness (the root of alpha) and cosine, each from 0 to 1.
    """
    return Table(_albedo(_nodes(_ALBEDO_NODES), _nodes(_ALBEDO_NODES)))


@cache
def mean_albedo_table() -> Table:
    """Cosine-weighted mean of :func:`albedo_table` over directions, by roughness."""
    points, weights = np.polynomial.legendre.leggauss(24)
    cosine = 0.5 + 0.5 * points
    return Table(_albedo(_nodes(_ALBEDO_NODES), cosine) @ (cosine * weights))


@cache
def fresnel_table() -> Table:
    """Where a dielectric's mean Fresnel reflectance lies between that at normal incidence and 1.

    The mean is over visible normals, except those that mirror below the horizon. The axes are
    roughness, cosine and sqrt((n - 1) / (n + 1)) for the refractive index n, each from 0 to 1.
    """
    rough = cosine = _nodes(_FRESNEL_NODES)
    # The mean is the product of a histogram of cosines with facets and their reflectance.
    edges = np.linspace(0.0, 1.0, _BINS + 1)
    counts = np.zeros((len(rough), len(cosine), _BINS + 1))
    for i, alpha in enumerate(rough**2):
        below, facing, _ = _reflected(alpha, cosine, 96)
        place = facing * _BINS
        low = np.minimum(place.astype(np.int64), _BINS - 1)
        for j in range(len(cosine)):
            for side, weight in ((0, low + 1.0 - place), (1, place - low)):
                kept = np.where(below[j], 0.0, weight[j])
                counts[i, j] += np.bincount(low[j] + side, kept, _BINS + 1)
        counts[i] /= facing.shape[1]
    root = np.clip(np.linspace(0.0, 1.0, _FRESNEL_NODES), _LOWEST, 0.99) ** 2
    normal = root * root
    reflectance = dielectric(edges[:, None], (1.0 + root) / (1.0 - root))
    return Table(np.clip(counts @ ((reflectance - normal) / (1.0 - normal)), 0.0, 1.0))


def _nodes(count: int) -> npt.NDArray[np.float64]:
    return np.clip(np.linspace(0.0, 1.0, count), _LOWEST, 1.0)


def _middles(count: int) -> npt.NDArray[np.float64]:
    return (np.arange(count) + 0.5) / count


def _reflected(
    alpha: float, cosine: npt.NDArray[np.float64], count: int
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Directions mirrored at evenly chosen visible normals, for each cosine.

    Returns whether they go below the horizon, the cosine with the facet, and the fraction that is
    not masked, all of shape (cosines, normals).
    """
    u, v = (x.reshape(-1) for x in np.meshgrid(_middles(count), 0.5 * _middles(count // 2)))
    z = cosine[:, None]
    wo = np.sqrt(1.0 - z * z), 0.0 * z, z
    normal = sample_visible(wo, u, v, (alpha, alpha))
    wi = reflect(wo, normal)
    below = wi[2] <= 0.0
    up = np.maximum(wi[2], 1e-9)
    lengths = up * stretched_length(wo, (alpha, alpha)), z * stretched_length(wi, (alpha, alpha))
    open_fraction = (lengths[0] + z * up) / (lengths[0] + lengths[1])
    return below, np.clip(dot(wo, normal), 0.0, 1.0), np.where(below, 0.0, open_fraction)


def _albedo(
    rough: npt.NDArray[np.float64], cosine: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Shape (roughnesses, cosines)."""
    return np.stack([_reflected(r * r, cosine, 64)[2].mean(axis=1) for r in rough])
