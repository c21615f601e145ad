"""Importance sampling by the microfacets of a reflectance, found by power iteration.

Dupuy, Heitz, Iehl, Poulin and Ostromoukhov 2015, "Extracting Microfacet-based BRDF Parameters from
Arbitrary Materials with Power Iterations": the view is mirrored about normals drawn as it sees
them, from the density of normals that the reflectance itself has.
"""

from __future__ import annotations

import math

import numpy as np

from nacre.brdf import Brdf
from nacre.measured.adaptive import AdaptiveWarp
from nacre.measured.rgl_tables import RglTables
from nacre.measured.rgl_writer import Resolution, normal_fields, view_nodes
from nacre.sampling.microfacets import NormalGrid

_UNIFORM = 0.01  # share of normals of any direction: what is reflected anywhere is sampled


def microfacet_sampler(brdf: Brdf, resolution: Resolution | None = None) -> AdaptiveWarp:
    """Visible normals by power iteration, as tables of views; the density is that of the tables.

    For `resolution` see :func:`nacre.measured.rgl_writer.tabulate_tables`; the square does not
    matter. A FormatError says that `brdf` is anisotropic and the azimuths of the view too few for
    it.
    """
    nodes, phi_i, theta_i = view_nodes(brdf, resolution)
    grid = NormalGrid(nodes.azimuths, nodes.polars, brdf.isotropic)
    normals = (1.0 - _UNIFORM) * grid.density(brdf) + _UNIFORM / math.pi
    # The map from the square to normals is that of an RGL table whose every point is alike.
    alike = np.ones((len(phi_i), len(theta_i), 3, 2, 2), np.float32)
    fields = normal_fields(brdf, grid, normals, phi_i, theta_i)
    tables = RglTables(luminance=alike[:, :, 0], rgb=alike, **fields)
    return AdaptiveWarp(tables, "visible normals by power iteration")
