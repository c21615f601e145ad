"""Microfacets extracted from any reflectance, after Dupuy, Heitz, Iehl, Poulin and Ostromoukhov
2015, "Extracting Microfacet-based BRDF Parameters from Arbitrary Materials with Power Iterations".
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.analytic.factor import (
    NODES,
    Cells,
    FactoredBrdf,
    even_angles,
    half_angles,
    locate,
    lookup,
)
from nacre.analytic.model import TableParameter, Values
from nacre.array import Array, Components, Floats, namespace
from nacre.brdf import Brdf
from nacre.geometry import from_rusinkiewicz_angles, join
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.progress import Progress
from nacre.sampling.microfacets import GRAZING, NormalGrid, polar_nodes

_AZIMUTHS = 32  # nodes of the half vector's azimuth, over which D is averaged
_LARGEST = 1e3  # bound of F
_DARK = 1e-4  # f_r in 1/sr of facets that reflect everything, below which they tell nothing of F


class TabulatedMicrofacets(FactoredBrdf):
    """F D G / (4 cos theta_i cos theta_o) with tables of D and F, and Smith's G for that D.

    `distribution` is D, a function of theta_h; `area` is the projected area sigma(theta) of all
    facets, from which G follows with heights correlated (Heitz 2014, equation 99); `fresnel` is F,
    a function of theta_d per channel. With 90 nodes each that is 450 numbers, 1800 bytes.
    """

    model = "tabulated-microfacets"
    parameters = ()
    tables = (
        TableParameter("distribution", 1, NODES, 1e12),
        TableParameter("area", 1, NODES, 10.0),
        TableParameter("fresnel", 3, NODES, _LARGEST),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        cells = locate(wi, wo)
        facets = lookup(values["distribution"], 0, cells.half) / _shadowing(values, wi, wo, cells)
        fresnel = (lookup(values["fresnel"], k, cells.difference) for k in range(3))
        red, green, blue = (facets * f for f in fresnel)
        return red, green, blue

    @classmethod
    def extract(
        cls, brdf: Brdf, samples: DirectionSamples, gain: float, seed: int, report: Progress
    ) -> tuple[dict[str, Any], dict[str, float]]:
        """D by power iteration on light sent straight back, then F from what D leaves to explain.

        F is the mean over theta_h, at phi_d = 90 degrees, of f_r over that of facets that reflect
        everything. It exceeds 1 where facets alone cannot explain what is reflected, as on white
        paper. Samples, gain and seed do not matter. The facts are alpha of GGX and of Beckmann's
        distribution for the same D.
        """
        grid = NormalGrid(_AZIMUTHS, NODES, brdf.isotropic)
        found = grid.density(brdf, correlated=True).mean(axis=0)
        density = np.broadcast_to(found, grid.shape)
        seen = grid.projected_area(density).mean(axis=0)
        area = np.interp(even_angles(), polar_nodes(NODES), seen)
        tables: dict[str, Any] = {"distribution": [found], "area": [area]}
        fresnel = _fresnel(brdf, cls(**tables, fresnel=np.ones((3, NODES))))
        return tables | {"fresnel": fresnel}, {
            "ggx roughness": grid.ggx_roughness(density),
            "beckmann roughness": grid.beckmann_roughness(density),
        }


def _shadowing(values: Values, wi: Components, wo: Components, cells: Cells) -> Array:
    """4 cos theta_i cos theta_o / G, which does not vanish at the horizon."""
    light, view = (lookup(values["area"], 0, cell) for cell in (cells.light, cells.view))
    both = light * wo[2] + view * wi[2] - wi[2] * wo[2]
    return 4.0 * namespace(both).maximum(both, 1e-12)


def _fresnel(brdf: Brdf, facets: TabulatedMicrofacets) -> Floats:
    """F at the nodes of theta_d, shape (3, nodes); where nothing is known, that of a neighbor."""
    angles = half_angles()[None, :], 0.0, even_angles()[:, None], 0.5 * np.pi
    wi, wo = (join(w) for w in from_rusinkiewicz_angles(*angles))
    truth, whole = brdf.eval(wi, wo), facets.eval(wi, wo)[..., 0]
    high = np.minimum(wi[..., 2], wo[..., 2]) > math.cos(GRAZING)
    known = high & brdf.valid(wi, wo) & np.isfinite(truth).all(axis=-1) & (whole > _DARK)
    ratio = np.where(known[..., None], truth / np.maximum(whole, _DARK)[..., None], 0.0)
    count = known.sum(axis=1)
    mean = ratio.sum(axis=1) / np.maximum(count, 1)[:, None]
    nodes = np.arange(NODES)
    if not count.any():
        return np.zeros((3, NODES))
    mended = [np.interp(nodes, nodes[count > 0], channel[count > 0]) for channel in mean.T]
    return np.asarray(np.clip(mended, 0.0, _LARGEST), np.float64)
